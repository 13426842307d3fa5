"""A cylinder by least squares on the true corners of the faces that follow it, without what recedes from it. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright.geometry.surfaces import least_squares_cylinder
from gripwright_builtin.fitters.chance import EXACT, likely
from gripwright_builtin.fitters.following import corners_of, distance_from, following, places_of
from gripwright_builtin.fitters.judgement import (
    SPREAD,
    bent_over_plane,
    every_corner,
    facets_of,
    pattern_of,
    scored,
    worth_of,
    worth_of_plane,
)
from gripwright_builtin.fitters.patch import Patch
from gripwright_builtin.fitters.proposals import AXIS, LARGEST_RADIUS, RADIUS, SIGN

FAR = 0.02  # of the size: surface farther from a cylinder does not speak for it
FAR_OF_RADIUS = 0.1
CLEAN = 1e-3  # of the radius: deviation below which the surface carries no noise
_ROUNDS = 6
_ITERATIONS = 12
_ASTRAY = 3.5  # standard errors
_SINGULAR = 1e-14
_STRIP = 1e4  # of `bent`: no strip of a plane


RMS, RADIUS_SIGMA, AXIS_SIGMA = 8, 9, 10
FACET = 11  # angle of a facet, rad; 0 for a prism
BENT = 12  # by how much a plane's sum of squares is larger, in squared standard deviations; 0 for a strip of a plane
PATTERN = 13  # correlation of neighbouring corners' distances: 0 for noise, 1 where the shape is another
ARC = 14  # longest run of facets side by side, rad
WORTH = 15  # how little likely so many points so near are by chance: minus the logarithm
AREA = 16
SCORE = 17  # area times the digits of its closeness; 0: no cylinder
WIDTH = 18
"""Columns of a fitted cylinder after those of a hypothesis; lengths are shares of the patch's size."""


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def tolerance(cylinder: FloatArray, rms: float) -> float:
    """Distance within which a surface lies on a cylinder."""
    return float(max(4.0 * rms, CLEAN * cylinder[RADIUS]))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def refine(
    patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, start: FloatArray, far: float, found: FloatArray
) -> bool:
    """Write the least squares from a start to `found` (18,); twice, since better knows better which faces follow.

    `chosen` are the faces looked at, `shares` the area that each stands for. False where there is no cylinder.
    """
    found[:] = 0.0
    cylinder, rms = found[:RMS], 0.0
    cylinder[:] = start[:RMS]
    corners, points, kept = np.empty(0, np.int64), np.empty((0, 3)), np.empty(0, np.bool_)
    near = np.zeros(0, np.bool_)
    matrix = np.empty((5, 5))
    for again in range(2):
        band = tolerance(cylinder, rms) if again else min(far, FAR_OF_RADIUS * cylinder[RADIUS])
        near = following(patch, normals, chosen, shares, cylinder, band)
        corners = corners_of(patch, chosen, near)
        points = places_of(patch, corners)
        kept, rms, matrix = _trimmed(points, cylinder, band, again == 1)
        if not len(kept) or not 0.0 < cylinder[RADIUS] < LARGEST_RADIUS:
            return False
    rms, matrix = _levelled(points, kept, cylinder, rms, matrix)
    found[RMS] = rms
    found[RADIUS_SIGMA], found[AXIS_SIGMA] = _errors(matrix, rms, int(kept.sum()))
    if not found[RADIUS_SIGMA] >= 0.0:
        return False
    for s in range(len(chosen)):
        if near[s]:
            found[AREA] += shares[s]
    found[FACET], found[ARC] = facets_of(patch, chosen, shares, near, corners[kept], cylinder)
    found[WORTH], found[PATTERN] = worth_of(patch, corners, cylinder, far), pattern_of(patch, chosen, near, cylinder, rms)
    bent = bent_over_plane(points[kept], rms)
    if bent >= _STRIP or worth_of_plane(patch, points[kept], far) <= 2.0 * worth_of(patch, every_corner(patch), cylinder, far):
        found[BENT] = bent
    found[SCORE] = scored(patch, normals, chosen, shares, cylinder, far)
    return bool(found[SCORE] > 0.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fit(points: FloatArray, cylinder: FloatArray, iterations: int) -> tuple[float, FloatArray]:
    """Least squares; changes the cylinder, returns the root mean square distance (−1: none) and JᵀJ."""
    if len(points) < 6:
        return -1.0, np.empty((5, 5))
    point, axis, radius, cost, matrix = least_squares_cylinder(
        points, cylinder[:3], cylinder[AXIS : AXIS + 3], cylinder[RADIUS], iterations
    )
    cylinder[:3] = point
    cylinder[AXIS : AXIS + 3] = axis
    cylinder[RADIUS] = radius
    return np.sqrt(cost / len(points)), matrix


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _trimmed(points: FloatArray, cylinder: FloatArray, band: float, last: bool) -> tuple[BoolArray, float, FloatArray]:
    """Least squares on the points whose closeness is least likely by chance, again as long as they change; and which."""
    kept, far = np.zeros(len(points), np.bool_), np.empty(len(points))
    rms, matrix = -1.0, np.empty((5, 5))
    for _ in range(_ROUNDS if last else _ROUNDS // 2):
        for i in range(len(points)):
            far[i] = abs(distance_from(points[i], cylinder))
        limit = SPREAD * likely(far, band, 5)[0]
        changed = 0
        for i in range(len(points)):
            now = far[i] <= limit
            changed += now != kept[i]
            kept[i] = now
        if not changed:
            break
        rms, matrix = _fit(points[kept], cylinder, _ITERATIONS if last else _ITERATIONS // 3)
        if rms < 0.0 or not 0.0 < cylinder[RADIUS] < LARGEST_RADIUS:
            return np.empty(0, np.bool_), rms, matrix
    return kept, rms, matrix


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _levelled(
    points: FloatArray, kept: BoolArray, cylinder: FloatArray, rms: float, matrix: FloatArray
) -> tuple[float, FloatArray]:
    """The fit without the points at either end that recede from it: fillets that hide in the noise."""
    order = np.flatnonzero(kept)
    along = np.empty(len(order))
    for i in range(len(order)):
        along[i] = points[order[i]] @ cylinder[AXIS : AXIS + 3]
    order = order[np.argsort(along)]
    first, last = 0, len(order)
    for _ in range(4):
        if rms <= 10.0 * EXACT:
            break
        low, high = _receding(points, order[first:last], cylinder, rms)
        if low + high == 0 or last - first - low - high < max(6, len(order) // 3):
            break
        first, last = first + low, last - high
        better, now = _fit(points[order[first:last]], cylinder, _ITERATIONS)
        if better < 0.0:
            break
        rms, matrix = better, now
    kept[:] = False
    kept[order[first:last]] = True
    return rms, matrix


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _receding(points: FloatArray, order: IntArray, cylinder: FloatArray, rms: float) -> tuple[int, int]:
    """How many points, from either end of `order`, lie deeper than noise explains: where their sum is least likely."""
    count = len(order)
    cut = np.zeros(2, np.int64)
    for end in range(2):
        total, worst = 0.0, -_ASTRAY
        for i in range(count // 2):
            total += distance_from(points[order[count - 1 - i if end else i]], cylinder) * cylinder[SIGN]
            errors = total / (rms * np.sqrt(i + 1.0))
            if i >= 2 and errors < worst:
                worst, cut[end] = errors, i + 1
    return cut[0], cut[1]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _errors(matrix: FloatArray, rms: float, count: int) -> tuple[float, float]:
    """Standard errors of radius and axis, σ² (JᵀJ)⁻¹; −1 where the points determine no cylinder."""
    factor = np.zeros((5, 5))
    for i in range(5):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j:
                if not total > _SINGULAR * matrix[i, i]:
                    return -1.0, -1.0
                factor[i, i] = np.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
    inverse = np.zeros((5, 5))  # of the factor
    for j in range(5):
        inverse[j, j] = 1.0 / factor[j, j]
        for i in range(j + 1, 5):
            total = 0.0
            for k in range(j, i):
                total -= factor[i, k] * inverse[k, j]
            inverse[i, j] = total / factor[i, i]
    variance = rms * rms * count / max(count - 5, 1)
    axis = 0.0
    for i in range(5):
        axis += inverse[i, 0] ** 2 + inverse[i, 1] ** 2
    return np.sqrt(variance) * abs(inverse[4, 4]), np.sqrt(variance * axis)
