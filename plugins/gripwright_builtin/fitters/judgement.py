"""How well a fitted cylinder speaks for a surface: against chance, a plane, another shape and other cylinders. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright_builtin.fitters.chance import EXACT, likely
from gripwright_builtin.fitters.following import distance_from, following, places_of
from gripwright_builtin.fitters.lateral import angles_about, facet_width_rad, longest_run, weighted_median, width_of
from gripwright_builtin.fitters.patch import Patch

SPREAD = 1.6  # times the likely distance from which a point is an outlier
_NOISE_MAX = 4.0  # standard deviations
_JUDGED = 600  # points that tell a plane from a cylinder


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def facets_of(
    patch: Patch, chosen: IntArray, shares: FloatArray, near: BoolArray, corners: IntArray, cylinder: FloatArray
) -> tuple[float, float]:
    """Typical angle of a facet and the longest run of facets side by side; 0 for a prism.

    The angle is that between columns of corners or, where noise blurs these, that of the faces.
    """
    angles = angles_about(patch.points, cylinder)
    between = facet_width_rad(angles[corners])
    if not between > 0.0:
        return 0.0, 0.0
    widths, areas, count = np.empty(len(chosen)), np.empty(len(chosen)), 0
    for s in range(len(chosen)):
        if near[s]:
            f = chosen[s]
            widths[count] = width_of(angles, patch.faces[f, 0], patch.faces[f, 1], patch.faces[f, 2])[1]
            areas[count] = shares[s]
            count += 1
    facet = max(between, weighted_median(widths[:count], areas[:count]))
    return facet, longest_run(angles[corners], 1.6 * facet)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def every_corner(patch: Patch) -> IntArray:
    """True corners of a patch, some hundred at most, ascending."""
    corners = np.flatnonzero(patch.corner)
    return corners[:: len(corners) // _JUDGED + 1]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def worth_of(patch: Patch, corners: IntArray, cylinder: FloatArray, far: float) -> float:
    """How little likely it is that so many corners lie so near to a cylinder by chance."""
    distances = np.empty(len(corners))
    for i in range(len(corners)):
        distances[i] = abs(distance_from(patch.points[corners[i]], cylinder))
    return float(likely(distances, far, 5)[1])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def worth_of_plane(patch: Patch, points: FloatArray, far: float) -> float:
    """The same of the plane through some points, and through what else is near it."""
    corners, best = every_corner(patch), 0.0
    places = places_of(patch, corners)
    for _ in range(2):
        if len(points) < 4:
            break
        middle = np.array([points[:, 0].mean(), points[:, 1].mean(), points[:, 2].mean()])
        centred = points - middle
        normal = np.ascontiguousarray(np.linalg.eigh(centred.T @ centred)[1][:, 0])
        distances = np.abs((places - middle) @ normal)
        limit, worth = likely(distances, far, 3)
        best = max(best, worth)
        points = places[distances <= SPREAD * limit]
    return best


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def bent_over_plane(points: FloatArray, rms: float) -> float:
    """By how much a plane's sum of squares is larger, in squared standard deviations."""
    middle = np.array([points[:, 0].mean(), points[:, 1].mean(), points[:, 2].mean()])
    centred = points - middle
    flat = max(np.linalg.eigvalsh(centred.T @ centred)[0], 0.0)
    return float((flat - len(points) * rms * rms) / max(rms * rms, EXACT * EXACT))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def pattern_of(patch: Patch, chosen: IntArray, near: BoolArray, cylinder: FloatArray, rms: float) -> float:
    """Correlation of the distances of true corners that share a face; 0 where they are but rounding."""
    if rms < 10.0 * EXACT:
        return 0.0
    off, product, square = np.empty(3), 0.0, 0.0
    for s in range(len(chosen)):
        if near[s]:
            for k in range(3):
                v = patch.faces[chosen[s], k]
                off[k] = distance_from(patch.points[v], cylinder) if patch.corner[v] else np.inf
            for k in range(3):
                a, b = off[k], off[(k + 1) % 3]
                if max(abs(a), abs(b)) < _NOISE_MAX * rms:
                    product += a * b
                    square += (a * a + b * b) / 2.0
    return float(product / max(square, 1e-300))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def scored(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, cylinder: FloatArray, far: float) -> float:
    """Area of the faces that follow a cylinder times the digits of their closeness."""
    near, score = following(patch, normals, chosen, shares, cylinder, far), 0.0
    for s in range(len(chosen)):
        if near[s]:
            off = 0.0
            for k in range(3):
                off = max(off, abs(distance_from(patch.points[patch.faces[chosen[s], k]], cylinder)))
            score += shares[s] * max(np.log(far / max(off, 10.0 * EXACT)), 0.0)
    return score


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fading(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, cylinder: FloatArray, noise: float) -> float:
    """Area of the faces that follow a cylinder, fading with their distance for noise of a known size (MSAC)."""
    limit = _NOISE_MAX * noise
    near, total = following(patch, normals, chosen, shares, cylinder, limit), 0.0
    for s in range(len(chosen)):
        if near[s]:
            square = 0.0
            for k in range(3):
                square += distance_from(patch.points[patch.faces[chosen[s], k]], cylinder) ** 2 / 3.0
            total += shares[s] * max(1.0 - square / (limit * limit), 0.0)
    return total
