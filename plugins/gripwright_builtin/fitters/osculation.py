"""Cylinders that osculate the parts of a patch that face one way: what tells short arcs whose normals noise hides. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright.geometry.surfaces import perpendiculars
from gripwright_builtin.fitters.chance import likely
from gripwright_builtin.fitters.patch import Patch
from gripwright_builtin.fitters.proposals import AXIS, LARGEST_RADIUS, RADIUS, SIGN

_ONE_WAY = 0.75  # cosine between a part's mean direction and its normals
_ENOUGH = 150  # points of a part
_DIRECTIONS = 10  # of an axis in a part's mean plane
_BEST = 3


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def osculating(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, parts: int, wide: float) -> FloatArray:
    """Some cylinders a part, as hypotheses (h, 8)."""
    left = shares.copy()
    found, count = np.empty((parts * _BEST, 8)), 0
    for _ in range(parts):
        part = _part(normals, chosen, left)
        vertices = _vertices(patch, chosen, part)
        mean = np.zeros(3)
        for s in range(len(chosen)):
            if part[s]:
                left[s] = 0.0
                mean += shares[s] * normals[chosen[s]]
        length = np.sqrt(mean @ mean)
        if len(vertices) < 6 or not length > 0.0:
            continue
        vertices = vertices[:: len(vertices) // _ENOUGH + 1]
        count += _swept(patch.points[vertices], mean / length, wide, found[count:])
    return found[:count]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _swept(points: FloatArray, up: FloatArray, band: float, found: FloatArray) -> int:
    """Parabolas across some directions of a part's mean plane; the least likely ones by chance become cylinders."""
    frame = np.empty((2, 3))
    perpendiculars(up, frame)
    tries, values = np.empty((_DIRECTIONS, 8)), np.zeros(_DIRECTIONS)
    u, v, far, keep = np.empty(len(points)), np.empty(len(points)), np.empty(len(points)), np.ones(len(points), np.bool_)
    for i in range(len(points)):
        v[i] = points[i, 0] * up[0] + points[i, 1] * up[1] + points[i, 2] * up[2]
    for d in range(_DIRECTIONS):
        angle, middle = np.pi * d / _DIRECTIONS, 0.0
        across = np.cos(angle) * frame[0] + np.sin(angle) * frame[1]
        for i in range(len(points)):
            u[i] = points[i, 0] * across[0] + points[i, 1] * across[1] + points[i, 2] * across[2]
            middle += u[i] / len(points)
        for i in range(len(points)):
            u[i] -= middle
            keep[i] = True
        a = b = c = 0.0
        for _ in range(2):
            a, b, c = _parabola(u, v, keep)
            for i in range(len(points)):
                far[i] = abs(v[i] - a - u[i] * (b + u[i] * c))
            limit, values[d] = likely(far, band, 4)
            for i in range(len(points)):
                keep[i] = far[i] <= 1.6 * limit
        slope = np.sqrt(1.0 + b * b)
        if abs(c) * 2.0 < 1.0 / LARGEST_RADIUS:
            values[d] *= 0.5
        radius: float = min(slope**3 / max(abs(2.0 * c), 1e-9), LARGEST_RADIUS * 0.99)
        side = 1.0 if c > 0.0 else -1.0
        tries[d, :3] = middle * across + a * up + side * radius * (up - b * across) / slope
        tries[d, AXIS : AXIS + 3] = np.cross(across, up)
        tries[d, RADIUS], tries[d, SIGN] = radius, -side
    count = 0
    for _ in range(_BEST):
        best = int(np.argmax(values))
        if not values[best] > 0.0:
            break
        found[count] = tries[best]
        count += 1
        for d in range(-1, 2):
            values[(best + d) % _DIRECTIONS] = 0.0
    return count


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _parabola(u: FloatArray, v: FloatArray, keep: BoolArray) -> tuple[float, float, float]:
    """v = a + b u + c u² by least squares."""
    s0 = s1 = s2 = s3 = s4 = t0 = t1 = t2 = 0.0
    for i in range(len(u)):
        if keep[i]:
            x, y = u[i], v[i]
            s0 += 1.0
            s1 += x
            s2 += x * x
            s3 += x * x * x
            s4 += x * x * x * x
            t0 += y
            t1 += x * y
            t2 += x * x * y
    det = s0 * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
    if not abs(det) > 1e-14 * s0 * s2 * s4:
        return t0 / max(s0, 1.0), 0.0, 0.0
    a = (t0 * (s2 * s4 - s3 * s3) - s1 * (t1 * s4 - t2 * s3) + s2 * (t1 * s3 - t2 * s2)) / det
    b = (s0 * (t1 * s4 - t2 * s3) - t0 * (s1 * s4 - s2 * s3) + s2 * (s1 * t2 - s2 * t1)) / det
    c = (s0 * (s2 * t2 - s3 * t1) - s1 * (s1 * t2 - s2 * t1) + t0 * (s1 * s3 - s2 * s2)) / det
    return a, b, c


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _part(normals: FloatArray, chosen: IntArray, left: FloatArray) -> BoolArray:
    """The faces that face as most of what is left does."""
    mean, part = np.zeros(3), np.zeros(len(chosen), np.bool_)
    for s in range(len(chosen)):
        mean += left[s] * normals[chosen[s]]
    if not np.sqrt(mean @ mean) > 0.1 * left.sum():
        mean = normals[chosen[np.argmax(left)]].copy()
    for _ in range(3):  # towards the middle of the part
        length = max(float(np.sqrt(mean @ mean)), 1e-300)
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
