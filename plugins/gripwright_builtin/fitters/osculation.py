"""Cylinders that osculate the parts of a patch that face one way: what tells short arcs whose normals noise hides. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright_builtin.fitters.patch import Patch
from gripwright_builtin.fitters.proposals import AXIS, LARGEST_RADIUS, RADIUS, SIGN

_ONE_WAY = 0.75  # cosine between a part's mean direction and its normals
_REWEIGHTS = 6
_FLAT = 1e-6  # curvature, of 1 / size


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def osculating(patch: Patch, normals: FloatArray, chosen: IntArray, parts: int) -> FloatArray:
    """One cylinder a part, as hypotheses (h, 8)."""
    left = patch.areas[chosen]
    found, count = np.empty((parts, 8)), 0
    for _ in range(parts):
        part = _part(normals, chosen, left)
        vertices = _vertices(patch, chosen, part)
        for s in range(len(chosen)):
            if part[s]:
                left[s] = 0.0
        if len(vertices) < 6:
            continue
        mean = np.zeros(3)
        for s in range(len(chosen)):
            if part[s]:
                mean += patch.areas[chosen[s]] * normals[chosen[s]]
        if _osculate(patch.points[vertices], mean, found[count]):
            count += 1
    return found[:count]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _part(normals: FloatArray, chosen: IntArray, left: FloatArray) -> BoolArray:
    """The faces that face as most of what is left does."""
    mean, part = np.zeros(3), np.zeros(len(chosen), np.bool_)
    for s in range(len(chosen)):
        mean += left[s] * normals[chosen[s]]
    if not np.sqrt(mean @ mean) > 0.1 * left.sum():
        mean = normals[chosen[np.argmax(left)]].copy()
    for _ in range(3):  # towards the middle of the part
        length = max(np.sqrt(mean @ mean), 1e-300)
        new = np.zeros(3)
        for s in range(len(chosen)):
            part[s] = left[s] > 0.0 and normals[chosen[s]] @ mean > _ONE_WAY * length
            if part[s]:
                new += left[s] * normals[chosen[s]]
        mean = new
    return part


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _vertices(patch: Patch, chosen: IntArray, part: BoolArray) -> IntArray:
    """True corners of the part's faces."""
    which = np.zeros(len(patch.points), np.bool_)
    for s in range(len(chosen)):
        if part[s]:
            for k in range(3):
                which[patch.faces[chosen[s], k]] = True
    return np.flatnonzero(which & patch.corner)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _osculate(points: FloatArray, outwards: FloatArray, found: FloatArray) -> bool:
    """Write the cylinder of the quadratic height field over a part's mean plane, robust by reweighting; False where flat."""
    length = np.sqrt(outwards @ outwards)
    if not length > 0.0:
        return False
    up = outwards / length
    e1 = np.zeros(3)
    e1[np.argmin(np.abs(up))] = 1.0
    e1 = e1 - (e1 @ up) * up
    e1 /= np.sqrt(e1 @ e1)
    e2 = np.cross(up, e1)
    centre = np.array([np.median(points[:, 0]), np.median(points[:, 1]), np.median(points[:, 2])])
    v = points - centre
    x, y, z = v @ e1, v @ e2, v @ up
    terms = np.stack((x * x / 2.0, x * y, y * y / 2.0, x, y, np.ones_like(x)), axis=1)  # (n, 6)
    weight, fit = np.ones(len(z)), np.zeros(6)
    for _ in range(_REWEIGHTS):
        weighted = terms * weight.reshape(-1, 1)
        matrix = weighted.T @ weighted
        for k in range(6):
            matrix[k, k] *= 1.0 + 1e-12
            matrix[k, k] += 1e-15 * len(z)
        fit = np.linalg.solve(matrix, weighted.T @ (z * weight))
        residual = np.abs(z - terms @ fit)
        scale = 1.4826 * np.median(residual) + 1e-9
        weight = 1.0 / (1.0 + (residual / (2.0 * scale)) ** 2)
    values, vectors = np.linalg.eigh(np.array([[fit[0], fit[1]], [fit[1], fit[2]]]))
    bent = int(np.argmax(np.abs(values)))
    curvature = values[bent]
    if abs(curvature) < max(_FLAT, 1.0 / LARGEST_RADIUS):
        return False
    normal = up - fit[3] * e1 - fit[4] * e2
    normal /= np.sqrt(normal @ normal)
    axis = vectors[0, 1 - bent] * e1 + vectors[1, 1 - bent] * e2
    axis = axis - normal * (axis @ normal)
    found[:3] = centre + up * fit[5] + normal / curvature
    found[AXIS : AXIS + 3] = axis / np.sqrt(axis @ axis)
    found[RADIUS] = 1.0 / abs(curvature)
    found[SIGN] = 1.0 if curvature < 0.0 else -1.0
    return True
