"""The faces of a segment as compiled code looks at them: centred, of size 1, with true corners told from chord points."""

from typing import NamedTuple

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright.geometry.corners import corner_mask

_SHARP, _BLUNT = float(np.radians(3.0)), float(np.radians(72.0))  # between normals that are averaged
_SPREAD = 8.0  # times the angle to the most similar neighbour
_PASSES = 3


class Patch(NamedTuple):
    """A segment's surface; all lengths are shares of `size_mm`, all places relative to `origin_mm`."""

    points: FloatArray  # (n, 3) its vertices
    corner: BoolArray  # (n,) whether a vertex lies on the true surface
    faces: IntArray  # (m, 3)
    normals: FloatArray  # (m, 3), zero for a face without area
    areas: FloatArray  # (m,)
    origin_mm: FloatArray  # (3,)
    size_mm: float


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def patch_of(vertices_mm: FloatArray, mesh_faces: IntArray, ids: IntArray) -> Patch:
    """Faces `ids` of a mesh."""
    local = np.full(len(vertices_mm), -1, np.int64)
    used = np.empty(min(3 * len(ids), len(vertices_mm)), np.int64)
    faces = np.empty((len(ids), 3), np.int64)
    count = 0
    for f in range(len(ids)):
        for k in range(3):
            v = mesh_faces[ids[f], k]
            if local[v] < 0:
                local[v] = count
                used[count] = v
                count += 1
            faces[f, k] = local[v]
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(count):
        for k in range(3):
            low[k] = min(low[k], vertices_mm[used[i], k])
            high[k] = max(high[k], vertices_mm[used[i], k])
    size = max((high - low).max(), 1e-300) if count > 0 else 1.0
    origin = (low + high) / 2.0
    points = np.empty((count, 3))
    for i in range(count):
        for k in range(3):
            points[i, k] = (vertices_mm[used[i], k] - origin[k]) / size
    normals, areas = _normals(points, faces)
    corner = corner_mask(vertices_mm, mesh_faces, local, count)
    return Patch(points, corner, faces, normals, areas, origin, size)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _normals(points: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    normals, areas = np.zeros((len(faces), 3)), np.zeros(len(faces))
    for f in range(len(faces)):
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        bx, by, bz, cx, cy, cz = b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        areas[f] = length / 2.0
        if length > 0.0:
            normals[f, 0], normals[f, 1], normals[f, 2] = nx / length, ny / length, nz / length
    return normals, areas


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def smooth_normals(patch: Patch) -> FloatArray:
    """Normals averaged by area over the faces around that face alike, a few times, (m, 3)."""
    count = len(patch.points)
    start = np.zeros(count + 2, np.int64)
    for f in range(len(patch.faces)):
        for k in range(3):
            start[patch.faces[f, k] + 2] += 1
    for v in range(count):
        start[v + 2] += start[v + 1]
    star = np.empty(3 * len(patch.faces), np.int64)
    for f in range(len(patch.faces)):
        for k in range(3):
            v = patch.faces[f, k]
            star[start[v + 1]] = f
            start[v + 1] += 1
    normals, smoothed = patch.normals.copy(), np.empty_like(patch.normals)
    alike = np.cos(min(max(_SPREAD * _roughness(patch, start, star), _SHARP), _BLUNT))
    for _ in range(_PASSES):
        for f in range(len(patch.faces)):
            nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
            x, y, z = 0.0, 0.0, 0.0
            for k in range(3):
                v = patch.faces[f, k]
                for at in range(start[v], start[v + 1]):
                    g = star[at]
                    if nx * normals[g, 0] + ny * normals[g, 1] + nz * normals[g, 2] > alike:
                        area = patch.areas[g]
                        x += area * normals[g, 0]
                        y += area * normals[g, 1]
                        z += area * normals[g, 2]
            length = np.sqrt(x * x + y * y + z * z)
            if length > 0.0:
                x, y, z = x / length, y / length, z / length
            smoothed[f, 0], smoothed[f, 1], smoothed[f, 2] = x, y, z
        normals, smoothed = smoothed, normals
    return normals


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _roughness(patch: Patch, start: IntArray, star: IntArray) -> float:
    """Median angle between a face's normal and the most similar one around it, rad."""
    nearest = np.empty(len(patch.faces))
    for f in range(len(patch.faces)):
        nearest[f] = 4.0
        nx, ny, nz = patch.normals[f, 0], patch.normals[f, 1], patch.normals[f, 2]
        for k in range(3):
            v = patch.faces[f, k]
            for at in range(start[v], start[v + 1]):
                g = star[at]
                if g != f:
                    x, y, z = nx - patch.normals[g, 0], ny - patch.normals[g, 1], nz - patch.normals[g, 2]
                    nearest[f] = min(nearest[f], x * x + y * y + z * z)
    return float(np.sqrt(np.median(nearest)))
