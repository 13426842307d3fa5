"""Exact clipping of triangle soups by half-spaces and boxes."""

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray


def clip_triangles(triangles: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """The parts of triangles (m, 3, 3) with normal·p ≤ offset (closed), as triangles (k, 3, 3)."""
    if not len(triangles):
        return triangles
    height = triangles @ normal - offset  # (m, 3) > 0: outside
    outside = height > 0.0
    count = outside.sum(axis=1)  # (m,)
    pieces = [triangles[count == 0]]
    for inside_count in (1, 2):
        chosen = count == 3 - inside_count
        if not chosen.any():
            continue
        # roll each triangle so that its odd corner (the single one on its side) comes first
        odd = ~outside[chosen] if inside_count == 1 else outside[chosen]
        shift = (np.argmax(odd, axis=1)[:, None] + np.arange(3)) % 3  # (k, 3)
        rows = np.arange(len(shift))[:, None]
        corner, h = triangles[chosen][rows, shift], height[chosen][rows, shift]  # (k, 3, 3), (k, 3)
        share = (h[:, :1] / (h[:, :1] - h[:, 1:]))[..., None]  # (k, 2, 1)
        cut = corner[:, :1] + share * (corner[:, 1:] - corner[:, :1])  # (k, 2, 3) on the edges from the odd corner
        if inside_count == 1:
            pieces.append(np.stack([corner[:, 0], cut[:, 0], cut[:, 1]], axis=1))
        else:
            pieces.append(np.stack([cut[:, 0], corner[:, 1], corner[:, 2]], axis=1))
            pieces.append(np.stack([cut[:, 0], corner[:, 2], cut[:, 1]], axis=1))
    return np.asarray(np.concatenate(pieces))


def clip_to_box(triangles: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The parts of triangles (m, 3, 3) within low ≤ p ≤ high; infinite bounds are skipped."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]  # (m, 3)
    near = (np.maximum(np.maximum(a, b), c) >= low) & (np.minimum(np.minimum(a, b), c) <= high)
    result = triangles[near.all(axis=1)]
    for axis in range(3):
        direction = np.eye(3)[axis]
        if np.isfinite(high[axis]):
            result = clip_triangles(result, direction, float(high[axis]))
        if np.isfinite(low[axis]):
            result = clip_triangles(result, -direction, -float(low[axis]))
    return result


def corners_within(triangles: FloatArray, normals: FloatArray, offsets: FloatArray) -> FloatArray:
    """Corners (k, 3) of the parts of triangles (m, 3, 3) that lie within all half-spaces normals (f, 3) · p ≤ offsets (f,)."""
    return np.asarray(_corners_within(np.ascontiguousarray(triangles), np.ascontiguousarray(normals), offsets))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _corners_within(triangles: FloatArray, normals: FloatArray, offsets: FloatArray) -> FloatArray:
    faces = len(offsets)
    found = np.empty((4 * len(triangles) + faces + 3, 3))
    total = 0
    part, left = np.empty((faces + 3, 3)), np.empty((faces + 3, 3))  # each half-space adds a corner at the most
    height = np.empty(faces + 3)
    for t in range(len(triangles)):
        part[:3] = triangles[t]
        count = 3
        for f in range(faces):
            beyond = 0
            for i in range(count):
                height[i] = normals[f, 0] * part[i, 0] + normals[f, 1] * part[i, 1] + normals[f, 2] * part[i, 2] - offsets[f]
                beyond += height[i] > 0.0
            if beyond == 0:
                continue
            kept = 0
            for i in range(0 if beyond < count else count, count):
                j = (i + 1) % count
                if height[i] <= 0.0:
                    left[kept] = part[i]
                    kept += 1
                if (height[i] > 0.0) != (height[j] > 0.0):
                    share = height[i] / (height[i] - height[j])
                    for k in range(3):
                        left[kept, k] = part[i, k] + share * (part[j, k] - part[i, k])
                    kept += 1
            part, left, count = left, part, kept
            if count == 0:
                break
        if total + count > len(found):
            grown = np.empty((2 * len(found), 3))
            grown[:total] = found[:total]
            found = grown
        found[total : total + count] = part[:count]
        total += count
    return found[:total].copy()


def near_box(centres: FloatArray, reach: FloatArray, X: FloatArray, low: FloatArray, high: FloatArray) -> IntArray:
    """Indices of balls (centres (m, 3), radii (m,)) that may meet low ≤ p ≤ high once they are placed at X (4, 4)."""
    return np.asarray(_near_box(centres, reach, np.ascontiguousarray(X), low, high))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _near_box(centres: FloatArray, reach: FloatArray, X: FloatArray, low: FloatArray, high: FloatArray) -> IntArray:
    found = np.empty(len(centres), dtype=np.int64)
    count = 0
    for i in range(len(centres)):
        r = reach[i]
        for k in range(3):
            level = X[k, 0] * centres[i, 0] + X[k, 1] * centres[i, 1] + X[k, 2] * centres[i, 2] + X[k, 3]
            if level < low[k] - r or level > high[k] + r:
                break
        else:
            found[count] = i
            count += 1
    return found[:count].copy()


def longest_run(intervals: FloatArray, join: float = 1e-6) -> float:
    """Length of the longest connected union of closed intervals (n, 2)."""
    if not len(intervals):
        return 0.0
    ordered = intervals[np.argsort(intervals[:, 0])]
    ends = np.maximum.accumulate(ordered[:, 1])
    starts_new = np.concatenate([[True], ordered[1:, 0] > ends[:-1] + join])
    first = ordered[starts_new, 0]
    last = ends[np.append(np.flatnonzero(starts_new)[1:] - 1, len(ordered) - 1)]
    return float((last - first).max())
