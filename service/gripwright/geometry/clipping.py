"""Exact clipping of triangle soups by half-spaces and boxes."""

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray


def clip_to_box(triangles: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The parts of triangles (m, 3, 3) within low ≤ p ≤ high (closed; infinite bounds allowed), as triangles (k, 3, 3)."""
    return np.asarray(_clip_to_box(np.ascontiguousarray(triangles), low, high))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _clip_to_box(triangles: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    found = np.empty((2 * len(triangles) + 7, 3, 3))
    total = 0
    part, left = np.empty((9, 3)), np.empty((9, 3))  # each side adds a corner at the most
    for t in range(len(triangles)):
        part[:3] = triangles[t]
        count = 3
        for side in range(6):
            axis, sign = side // 2, 1.0 - 2.0 * (side % 2)
            limit = sign * (high[axis] if sign > 0.0 else low[axis])
            kept = 0
            for i in range(count):
                j = (i + 1) % count
                here, ahead = sign * part[i, axis] - limit, sign * part[j, axis] - limit  # > 0: outside
                if here <= 0.0:
                    left[kept] = part[i]
                    kept += 1
                if (here > 0.0) != (ahead > 0.0):
                    share = here / (here - ahead)
                    for k in range(3):
                        left[kept, k] = part[i, k] + share * (part[j, k] - part[i, k])
                    left[kept, axis] = sign * limit
                    kept += 1
            part, left, count = left, part, kept
            if count == 0:
                break
        if total + max(count - 2, 0) > len(found):
            grown = np.empty((2 * len(found) + 7, 3, 3))
            grown[:total] = found[:total]
            found = grown
        for k in range(1, count - 1):
            found[total, 0], found[total, 1], found[total, 2] = part[0], part[k], part[k + 1]
            total += 1
    return found[:total].copy()


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
