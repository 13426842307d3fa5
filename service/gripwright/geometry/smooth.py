"""Edge-preserving smoothing of values on a mesh's faces."""

import numba
import numpy as np

from gripwright.domain.shape import FloatArray, IntArray

NEIGHBOURS_MAX = 96
"""Faces that one face's window may hold: bounds the time on meshes far finer than the window."""
PARTS = 64
"""Pieces of the work that the threads share."""


def bilateral(values: FloatArray, centres_mm: FloatArray, areas_mm2: FloatArray, pairs: IntArray, radius_mm: float) -> FloatArray:
    """Mean of each face's neighbours within `radius_mm`, (m,), weighted by area, nearness and likeness of value.

    The window grows from face to face, so that it does not reach through the solid. Values are alike within 1.5 times the
    standard deviation of the window itself, as in CGAL's filter.
    """
    start, neighbour = neighbour_lists(pairs, len(values))
    return np.asarray(_bilateral(values, centres_mm, areas_mm2, start, neighbour, radius_mm, NEIGHBOURS_MAX, PARTS))


def neighbour_lists(pairs: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Neighbours of face f are `neighbour[start[f] : start[f + 1]]`."""
    left, right = np.concatenate((pairs, pairs[:, ::-1])).T
    order = np.argsort(left, kind="stable")
    start = np.concatenate(([0], np.cumsum(np.bincount(left, minlength=count))))
    return start, right[order]


@numba.njit(cache=True, parallel=True, nogil=True)  # type: ignore[untyped-decorator]
def _bilateral(
    values: FloatArray,
    centres: FloatArray,
    areas: FloatArray,
    start: IntArray,
    neighbour: IntArray,
    radius: float,
    most: int,
    parts: int,
) -> FloatArray:
    m = len(values)
    result = np.empty(m)
    for part in numba.prange(parts):
        seen = np.full(m, -1, dtype=np.int32)
        queue = np.empty(most, dtype=np.int64)
        nearness = np.empty(most)
        for face in range(part * m // parts, (part + 1) * m // parts):
            queue[0], nearness[0], size, head = face, 1.0, 1, 0
            seen[face] = face
            while head < size and size < most:
                for k in range(start[queue[head]], start[queue[head] + 1]):
                    other = neighbour[k]
                    if seen[other] == face or size == most:
                        continue
                    seen[other] = face
                    dx = centres[other, 0] - centres[face, 0]
                    dy = centres[other, 1] - centres[face, 1]
                    dz = centres[other, 2] - centres[face, 2]
                    square = (dx * dx + dy * dy + dz * dz) / (radius * radius)
                    if square <= 1.0:
                        queue[size], nearness[size] = other, np.exp(-2.0 * square)
                        size += 1
                head += 1
            spread, weight = 0.0, 0.0
            for i in range(size):
                spread += areas[queue[i]] * (values[queue[i]] - values[face]) ** 2
                weight += areas[queue[i]]
            if spread <= 0.0:
                result[face] = values[face]
                continue
            spread *= 1.5**2 / weight
            total, weight = 0.0, 0.0
            for i in range(size):
                w = areas[queue[i]] * nearness[i] * np.exp(-0.5 * (values[queue[i]] - values[face]) ** 2 / spread)
                total += w * values[queue[i]]
                weight += w
            result[face] = total / weight
    return result
