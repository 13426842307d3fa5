"""Edge-preserving smoothing of values on a mesh's faces."""

import numba
import numpy as np
import numpy.typing as npt

from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.adjacency import neighbour_lists

Int32Array = npt.NDArray[np.int32]

NEIGHBOURS_MAX = 96
"""Faces that one face's window may hold: bounds the time on meshes far finer than the window."""
FACES_A_RING = 2000.0
"""The published window has a ring for each multiple of the root of this number that the root of the number of faces is."""
LIKENESS = 1.5
"""Values are alike within this many standard deviations of the window itself, as published in CGAL."""
PARTS = 16
"""Pieces of the work that the threads share."""


def bilateral(values: FloatArray, centres_mm: FloatArray, areas_mm2: FloatArray, pairs: IntArray, radius_mm: float) -> FloatArray:
    """Mean of each face's neighbours within `radius_mm`, (m,), weighted by area, nearness and likeness of value.

    The window grows from face to face, so that it does not reach through the solid.
    """
    start, neighbour = neighbour_lists(pairs, len(values))
    return np.asarray(_bilateral(values, centres_mm / radius_mm, areas_mm2, start, neighbour, 0, NEIGHBOURS_MAX, PARTS))


def ring_bilateral(values: FloatArray, pairs: IntArray) -> FloatArray:
    """The same in rings of neighbours, (m,), whatever their areas and distances: depends on the tessellation, as in CGAL."""
    m = len(values)
    start, neighbour = neighbour_lists(pairs, m)
    rings = int(np.sqrt(m / FACES_A_RING)) + 1
    return np.asarray(_bilateral(values, np.zeros((m, 3)), np.ones(m), start, neighbour, rings, m, PARTS))


@numba.njit(cache=True, parallel=True, nogil=True)  # type: ignore[untyped-decorator]
def _bilateral(
    values: FloatArray,
    centres: FloatArray,
    areas: FloatArray,
    start: IntArray,
    neighbour: IntArray,
    rings: int,
    most: int,
    parts: int,
) -> FloatArray:
    """Windows of at most `most` faces with centres in the unit ball, or within that many rings where `rings` is not 0."""
    m = len(values)
    result = np.empty(m)
    for part in numba.prange(parts):
        seen = np.full(m, -1, dtype=np.int32)
        window = np.empty(most, dtype=np.int32)
        ring = np.zeros(most, dtype=np.int32)
        farness = np.zeros(most)  # square of the distance, 1 at the window's border
        for face in range(part * m // parts, (part + 1) * m // parts):
            window[0], size, head = face, 1, 0
            seen[face] = face
            while head < size and size < most:
                for k in range(start[window[head]], start[window[head] + 1]):
                    other = neighbour[k]
                    if seen[other] == face or size == most:
                        continue
                    seen[other] = face
                    if rings:
                        square = ((ring[head] + 1) / rings) ** 2
                    else:
                        dx = centres[other, 0] - centres[face, 0]
                        dy = centres[other, 1] - centres[face, 1]
                        dz = centres[other, 2] - centres[face, 2]
                        square = dx * dx + dy * dy + dz * dz
                    if square <= 1.0:
                        window[size], ring[size], farness[size] = other, ring[head] + 1, square
                        size += 1
                head += 1
            result[face] = _mean_of_alike(values, areas, window[:size], farness[:size])
    return result


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _mean_of_alike(values: FloatArray, areas: FloatArray, window: Int32Array, farness: FloatArray) -> float:
    """Weighted mean of the values in the window of its first face; the weights are normal densities."""
    value, spread, weight = values[window[0]], 0.0, 0.0
    for face in window:
        spread += areas[face] * (values[face] - value) ** 2
        weight += areas[face]
    if spread <= 0.0:
        return float(value)
    sharpness = 0.5 * weight / (LIKENESS**2 * spread)
    total, weight = 0.0, 0.0
    for i in range(len(window)):
        face = window[i]
        w = areas[face] * np.exp(-2.0 * farness[i] - sharpness * (values[face] - value) ** 2)
        total += w * values[face]
        weight += w
    return float(total / weight)
