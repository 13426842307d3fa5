"""Which faces of a patch follow a cylinder, and their true corners. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright_builtin.fitters.lateral import FACET_MAX_RAD, TILT_EXACT, TILT_MAX, weighted_median
from gripwright_builtin.fitters.patch import Patch
from gripwright_builtin.fitters.proposals import RADIUS, SIGN

_POINTS = 20000
_CHORD = 1.0 - float(np.cos(FACET_MAX_RAD / 2.0))  # of the radius: how deep the widest facet lies
_OUTWARDS = 0.5


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def distance_from(point: FloatArray, cylinder: FloatArray) -> float:
    """Of a point from the surface, positive outside."""
    x, y, z = point[0] - cylinder[0], point[1] - cylinder[1], point[2] - cylinder[2]
    along = x * cylinder[3] + y * cylinder[4] + z * cylinder[5]
    x, y, z = x - along * cylinder[3], y - along * cylinder[4], z - along * cylinder[5]
    return float(np.sqrt(x * x + y * y + z * z) - cylinder[RADIUS])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def following(
    patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, cylinder: FloatArray, band: float
) -> BoolArray:
    """Faces near the cylinder, facing as it does. Half of their area says how much normals may tilt along the axis."""
    near, tilt = np.zeros(len(chosen), np.bool_), np.empty(len(chosen))
    ax, ay, az, radius = cylinder[3], cylinder[4], cylinder[5], cylinder[RADIUS]
    middle = np.empty(3)
    for s in range(len(chosen)):
        f = chosen[s]
        tilt[s] = abs(normals[f, 0] * ax + normals[f, 1] * ay + normals[f, 2] * az)
        if tilt[s] >= TILT_MAX or not patch.areas[f] > 0.0:
            continue
        a, b, c = patch.faces[f, 0], patch.faces[f, 1], patch.faces[f, 2]
        for k in range(3):
            middle[k] = (patch.points[a, k] + patch.points[b, k] + patch.points[c, k]) / 3.0 - cylinder[k]
        along = middle[0] * ax + middle[1] * ay + middle[2] * az
        x, y, z = middle[0] - along * ax, middle[1] - along * ay, middle[2] - along * az
        distance = np.sqrt(x * x + y * y + z * z)
        if not -band <= radius - distance <= band + _CHORD * radius:
            continue
        out = (normals[f, 0] * x + normals[f, 1] * y + normals[f, 2] * z) * cylinder[SIGN]
        near[s] = out > _OUTWARDS * distance
    if near.any():
        limit = 3.0 * weighted_median(tilt[near], shares[near]) + TILT_EXACT
        for s in range(len(chosen)):
            near[s] = near[s] and tilt[s] <= limit
    return near


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def corners_of(patch: Patch, chosen: IntArray, near: BoolArray) -> IntArray:
    """True corners of some faces, at most some thousand, (p,)."""
    used, count = np.zeros(len(patch.points), np.bool_), 0
    for s in range(len(chosen)):
        if near[s]:
            for k in range(3):
                v = patch.faces[chosen[s], k]
                if patch.corner[v] and not used[v]:
                    used[v] = True
                    count += 1
    every = count // _POINTS + 1
    corners = np.empty(count // every + 1, np.int64)
    seen = taken = 0
    for v in range(len(used)):
        if used[v]:
            if seen % every == 0:
                corners[taken] = v
                taken += 1
            seen += 1
    return corners[:taken]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def places_of(patch: Patch, vertices: IntArray) -> FloatArray:
    """Where some vertices are, (k, 3)."""
    places = np.empty((len(vertices), 3))
    for i in range(len(vertices)):
        for k in range(3):
            places[i, k] = patch.points[vertices[i], k]
    return places
