"""Cylinders through pairs of a patch's faces, and how much of its surface follows each (consensus). Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.surfaces import perpendiculars
from gripwright_builtin.fitters.patch import Patch

LARGEST_RADIUS = 5.0  # of the patch's size: less than 12° of arc cannot be told from a plane
AXIS, RADIUS, SIGN = 3, 6, 7
"""Columns of a hypothesis: point (3), axis (3), radius, sign (+1 where normals point away from the axis, −1 towards it)."""
_SAMPLES = 160
_GLANCE = 36  # samples that tell whether a cylinder is worth the others
_ALONG_CAPS = 10  # pairs for each direction taken as an end face's
_TURNED = 0.02  # sine between normals that tell an axis
_BAND = 0.01  # of the size: distance at which a sample stops to count
_BAND_OF_RADIUS = 0.08
_NORMAL_COSINE = 0.75  # between a sample's normal and the radial direction
_TILT = 0.35  # of a sample's normal along the axis
_EXACT = 1e-4  # of the size: what lies so near counts twice


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def drawn(state: IntArray, below: int) -> int:
    """A number 0..below−1 of a linear congruential sequence (Knuth's MMIX)."""
    state[0] = state[0] * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
    return int((state[0] >> np.uint64(33)) % np.uint64(below))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def directions_of(normals: FloatArray, areas: FloatArray) -> tuple[IntArray, int]:
    """Number of each face's direction, about one degree wide, shared by faces with nearly the same normal; −1 without area."""
    slots = 16
    while slots < 2 * len(normals):
        slots *= 2
    keys, numbers = np.full(slots, -1, np.int64), np.empty(slots, np.int64)
    found, count = np.full(len(normals), -1, np.int64), 0
    for f in range(len(normals)):
        if not areas[f] > 0.0:
            continue
        key = 0
        for k in range(3):
            key = (key << 8) | (int(np.rint(normals[f, k] * 50.0)) + 64)
        at = (key * 2654435761 >> 8) & (slots - 1)
        while keys[at] >= 0 and keys[at] != key:
            at = (at + 1) & (slots - 1)
        if keys[at] < 0:
            keys[at], numbers[at] = key, count
            count += 1
        found[f] = numbers[at]
    return found, count


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def voices(areas: FloatArray, directions: IntArray, count: int) -> FloatArray:
    """Running sum of each face's chance to be drawn, (m,), the last is 1: by area, one voice a direction, one a face.

    So narrow facets are heard beside wide planes, and sound faces beside the large and lonely ones of outliers.
    """
    members = np.zeros(count)
    for f in range(len(areas)):
        if directions[f] >= 0:
            members[directions[f]] += 1.0
    total, running, area = areas.sum(), np.empty(len(areas)), 0.0
    for f in range(len(areas)):
        if directions[f] >= 0:
            area += areas[f] / total + 1.0 / (count * members[directions[f]]) + 1.0 / len(areas)
        running[f] = area
    return running / area


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def picked(state: IntArray, running: FloatArray) -> int:
    """A face drawn by its voice."""
    return int(np.searchsorted(running, (drawn(state, 1 << 30) + 0.5) / (1 << 30)))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def chance(running: FloatArray, face: int) -> float:
    """Of a face to be drawn."""
    return float(running[face] - (running[face - 1] if face > 0 else 0.0))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def sample(state: IntArray, areas: FloatArray, running: FloatArray) -> tuple[IntArray, FloatArray]:
    """At most some hundred faces in random order, and the area each stands for, so that sums over them are unbiased."""
    if len(areas) > _SAMPLES:
        faces, weights = np.empty(_SAMPLES, np.int64), np.empty(_SAMPLES)
        for s in range(_SAMPLES):
            faces[s] = picked(state, running)
            weights[s] = areas[faces[s]] / (chance(running, faces[s]) * _SAMPLES)
        return faces, weights
    faces = np.arange(len(areas))
    for s in range(len(areas) - 1, 0, -1):
        other = drawn(state, s + 1)
        faces[s], faces[other] = faces[other], faces[s]
    return faces, areas[faces]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def propose(
    state: IntArray,
    patch: Patch,
    normals: FloatArray,
    directions: IntArray,
    running: FloatArray,
    pairs: int,
    caps: int,
    found: FloatArray,
) -> int:
    """Write hypotheses to `found` (h, 8); returns their number.

    Two normals give the axis (their cross product) or, where one of the `caps` widest planes is taken as an end face, its does;
    then the corners of both faces give a circle, and so do their middles with the normals.
    """
    axis, scratch, count = np.empty(3), np.empty((12, 3)), 0
    for _ in range(pairs):
        f, g = picked(state, running), picked(state, running)
        length = 0.0
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            axis[k] = normals[f, i] * normals[g, j] - normals[f, j] * normals[g, i]
            length += axis[k] * axis[k]
        if length > _TURNED * _TURNED:
            for k in range(3):
                axis[k] /= np.sqrt(length)
            count = _circles(patch, normals, f, g, axis, scratch, found, count)
    weight, first = np.zeros(directions.max() + 1), np.full(directions.max() + 1, -1, np.int64)
    for f in range(len(directions)):
        if directions[f] >= 0:
            weight[directions[f]] += patch.areas[f]
            if first[directions[f]] < 0:
                first[directions[f]] = f
    for _ in range(min(caps, len(weight))):
        widest = int(np.argmax(weight))
        weight[widest] = -1.0
        axis[:] = normals[first[widest]]
        for _ in range(_ALONG_CAPS):
            f, g = picked(state, running), picked(state, running)
            across = abs(normals[f] @ axis) < 0.1 and abs(normals[g] @ axis) < 0.1
            if f != g and across:
                count = _circles(patch, normals, f, g, axis, scratch, found, count)
    return count


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _circles(
    patch: Patch, normals: FloatArray, f: int, g: int, axis: FloatArray, scratch: FloatArray, found: FloatArray, count: int
) -> int:
    """Two circles across the axis: of the normals and middles of two faces, and of their corners (least squares)."""
    frame, flat, n, middle = scratch[:2], scratch[2:8], scratch[8:10], scratch[10:12]
    perpendiculars(axis, frame)
    out = 0.0
    for e in range(2):
        face = g if e else f
        for k in range(2):
            u, v, w = frame[k, 0], frame[k, 1], frame[k, 2]
            n[e, k] = normals[face, 0] * u + normals[face, 1] * v + normals[face, 2] * w
            middle[e, k] = 0.0
            for c in range(3):
                at = patch.faces[face, c]
                flat[3 * e + c, k] = patch.points[at, 0] * u + patch.points[at, 1] * v + patch.points[at, 2] * w
                middle[e, k] += flat[3 * e + c, k] / 3.0
    tx, ty = n[0, 0] - n[1, 0], n[0, 1] - n[1, 1]
    square = tx * tx + ty * ty
    if square > 1e-6:
        r = ((middle[0, 0] - middle[1, 0]) * tx + (middle[0, 1] - middle[1, 1]) * ty) / square
        x = (middle[0, 0] + middle[1, 0] - r * (n[0, 0] + n[1, 0])) / 2.0
        y = (middle[0, 1] + middle[1, 1] - r * (n[0, 1] + n[1, 1])) / 2.0
        count = _added(frame, axis, x, y, abs(r), r, found, count)
    x, y, r = _circle(flat)
    for e in range(2):
        out += (middle[e, 0] - x) * n[e, 0] + (middle[e, 1] - y) * n[e, 1]
    return int(_added(frame, axis, x, y, r, out, found, count))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _added(
    frame: FloatArray, axis: FloatArray, x: float, y: float, radius: float, sign: float, found: FloatArray, count: int
) -> int:
    if not (1e-6 < radius < LARGEST_RADIUS) or count >= len(found):
        return count
    for k in range(3):
        found[count, k] = x * frame[0, k] + y * frame[1, k]
        found[count, AXIS + k] = axis[k]
    found[count, RADIUS] = radius
    found[count, SIGN] = 1.0 if sign > 0.0 else -1.0
    return count + 1


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _circle(flat: FloatArray) -> tuple[float, float, float]:
    """Centre and radius of the circle of least algebraic distances (Kåsa) to points (k, 2); radius 0 on a line."""
    mx = my = xx = xy = yy = xs = ys = ss = 0.0
    for i in range(len(flat)):
        mx += flat[i, 0] / len(flat)
        my += flat[i, 1] / len(flat)
    for i in range(len(flat)):
        u, v = flat[i, 0] - mx, flat[i, 1] - my
        s = u * u + v * v
        xx += u * u
        xy += u * v
        yy += v * v
        xs += u * s
        ys += v * s
        ss += s
    det = xx * yy - xy * xy
    if not det > 1e-12 * ss * ss:
        return 0.0, 0.0, 0.0
    a, b = (xs * yy - ys * xy) / (2.0 * det), (ys * xx - xs * xy) / (2.0 * det)
    return mx + a, my + b, np.sqrt(a * a + b * b + ss / len(flat))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def closeness(patch: Patch, normals: FloatArray, face: int, cylinder: FloatArray, wide: float) -> float:
    """2 for a face whose corner lies on a cylinder, 0 from the band's edge on and where the normal does not fit."""
    ax, ay, az = cylinder[3], cylinder[4], cylinder[5]
    nx, ny, nz = normals[face, 0], normals[face, 1], normals[face, 2]
    if abs(nx * ax + ny * ay + nz * az) >= _TILT:
        return 0.0
    v = patch.faces[face, face % 3]
    x, y, z = patch.points[v, 0] - cylinder[0], patch.points[v, 1] - cylinder[1], patch.points[v, 2] - cylinder[2]
    along = x * ax + y * ay + z * az
    x, y, z = x - along * ax, y - along * ay, z - along * az
    distance = np.sqrt(x * x + y * y + z * z)
    if (x * nx + y * ny + z * nz) * cylinder[SIGN] <= _NORMAL_COSINE * distance:
        return 0.0
    off = abs(distance - cylinder[RADIUS])
    share = off / min(_BAND * wide, _BAND_OF_RADIUS * cylinder[RADIUS])
    return float(max(1.0 - share * share, 0.0) + (1.0 if off < _EXACT else 0.0))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def support(
    patch: Patch,
    normals: FloatArray,
    faces: IntArray,
    weights: FloatArray,
    cylinder: FloatArray,
    wide: float,
    enough: float,
) -> float:
    """Area of the samples that follow a cylinder, fading with their distance (MSAC).

    Where the first samples promise much less than `enough`, what they promise.
    """
    total = 0.0
    for s in range(len(faces)):
        if s == _GLANCE and total * len(faces) < 0.5 * enough * _GLANCE:
            return total * len(faces) / _GLANCE
        if weights[s] > 0.0:
            total += weights[s] * closeness(patch, normals, faces[s], cylinder, wide)
    return total
