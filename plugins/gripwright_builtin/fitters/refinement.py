"""A cylinder by least squares on the true corners of the faces that follow it, without what recedes from it. Compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright.geometry.surfaces import least_squares_cylinder
from gripwright_builtin.fitters.lateral import FACET_MAX_RAD, TILT_EXACT, TILT_MAX, angles_about, facet_width_rad, longest_run, weighted_median, width_of
from gripwright_builtin.fitters.chance import EXACT, likely
from gripwright_builtin.fitters.patch import Patch
from gripwright_builtin.fitters.proposals import AXIS, LARGEST_RADIUS, RADIUS, SIGN

FAR = 0.02  # of the size: surface farther from a cylinder does not speak for it
CLEAN = 1e-3  # of the radius: deviation below which the surface carries no noise
_POINTS = 20000
_JUDGED = 600  # points that tell a plane from a cylinder
_TOUCHING = 3.0  # times the deviation of a clean surface
_LEAN = 0.1  # mean part of the normals along the axis
_STRIP = 1e4  # of `bent`: no strip of a plane
_ROUNDS = 6
_ITERATIONS = 12
_FAR_OF_RADIUS = 0.1
_CHORD = 1.0 - float(np.cos(FACET_MAX_RAD / 2.0))  # of the radius: how deep the widest facet lies
_OUTWARDS = 0.5
_SPREAD = 1.6  # times the likely distance from which a point is an outlier
_NOISE_MAX = 4.0  # standard deviations
_ASTRAY = 3.5  # standard errors
_SINGULAR = 1e-14


class Refined(NamedTuple):
    """A fitted cylinder; lengths are shares of the patch's size."""

    cylinder: FloatArray  # (8,) as a hypothesis
    rms: float
    radius_sigma: float
    axis_sigma_rad: float
    facet_rad: float
    bent: float  # by how much a plane's sum of squares is larger, in squared standard deviations; 0 for a strip of a plane
    pattern: float  # correlation of neighbouring corners' distances: 0 for noise, 1 where the shape is another
    arc_rad: float  # longest run of facets side by side
    worth: float  # how little likely so many points so near are by chance: minus the logarithm
    area: float
    score: float  # area times the digits of its closeness; 0: no cylinder


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def tolerance(cylinder: FloatArray, rms: float) -> float:
    """Distance within which a surface lies on a cylinder."""
    return max(4.0 * rms, CLEAN * cylinder[RADIUS])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def refined(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, start: FloatArray, far: float) -> Refined:
    """Least squares from a start; twice, since better knows better which faces follow.

    `chosen` are the faces looked at, `shares` the area that each stands for.
    """
    nothing = Refined(start.copy(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    cylinder, rms, singular = start.copy(), 0.0, False
    corners, points, kept = np.empty(0, np.int64), np.empty((0, 3)), np.empty(0, np.bool_)
    near = np.zeros(0, np.bool_)
    matrix = np.empty((5, 5))
    for again in range(2):
        band = tolerance(cylinder, rms) if again else min(far, _FAR_OF_RADIUS * cylinder[RADIUS])
        near = _following(patch, normals, chosen, shares, cylinder, band)
        corners = _corners(patch, chosen, near)
        points = _places(patch, corners)
        kept, rms, matrix = _trimmed(points, cylinder, band, again == 1)
        if not len(kept) or not 0.0 < cylinder[RADIUS] < LARGEST_RADIUS:
            return nothing
    rms, matrix = _levelled(points, kept, cylinder, rms, matrix)
    radius_sigma, axis_sigma = _errors(matrix, rms, int(kept.sum()))
    if not radius_sigma >= 0.0:
        return nothing
    area = 0.0
    for s in range(len(chosen)):
        if near[s]:
            area += shares[s]
    score = scored(patch, normals, chosen, shares, cylinder, far)
    facet, arc = _facets(patch, chosen, shares, near, corners[kept], cylinder)
    worth, pattern = _worth(patch, corners, cylinder, far), _pattern(patch, chosen, near, cylinder, rms)
    bent = _bent(points[kept], rms)
    if bent < _STRIP and _worth_of_plane(patch, points[kept], far) > 2.0 * _worth(patch, every_corner(patch), cylinder, far):
        bent = 0.0
    return Refined(cylinder, rms, radius_sigma, axis_sigma, facet, bent, pattern, arc, worth, area, score)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _facets(patch: Patch, chosen: IntArray, shares: FloatArray, near: BoolArray, corners: IntArray, cylinder: FloatArray) -> tuple[float, float]:
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
def _worth(patch: Patch, corners: IntArray, cylinder: FloatArray, far: float) -> float:
    """How little likely it is that so many corners lie so near to a cylinder by chance."""
    distances = np.empty(len(corners))
    for i in range(len(corners)):
        distances[i] = abs(_distance(patch.points[corners[i]], cylinder))
    return likely(distances, far, 5)[1]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _pattern(patch: Patch, chosen: IntArray, near: BoolArray, cylinder: FloatArray, rms: float) -> float:
    """Correlation of the distances of true corners that share a face; 0 where they are but rounding."""
    if rms < 10.0 * EXACT:
        return 0.0
    off, product, square = np.empty(3), 0.0, 0.0
    for s in range(len(chosen)):
        if near[s]:
            for k in range(3):
                v = patch.faces[chosen[s], k]
                off[k] = _distance(patch.points[v], cylinder) if patch.corner[v] else np.inf
            for k in range(3):
                a, b = off[k], off[(k + 1) % 3]
                if max(abs(a), abs(b)) < _NOISE_MAX * rms:
                    product += a * b
                    square += (a * a + b * b) / 2.0
    return product / max(square, 1e-300)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bent(points: FloatArray, rms: float) -> float:
    """By how much a plane's sum of squares is larger, in squared standard deviations."""
    middle = np.array([points[:, 0].mean(), points[:, 1].mean(), points[:, 2].mean()])
    centred = points - middle
    flat = max(np.linalg.eigvalsh(centred.T @ centred)[0], 0.0)
    return (flat - len(points) * rms * rms) / max(rms * rms, EXACT * EXACT)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _worth_of_plane(patch: Patch, points: FloatArray, far: float) -> float:
    """The same of the plane through some points, and through what else is near it."""
    corners, best = every_corner(patch), 0.0
    places = _places(patch, corners)
    for _ in range(2):
        if len(points) < 4:
            break
        middle = np.array([points[:, 0].mean(), points[:, 1].mean(), points[:, 2].mean()])
        centred = points - middle
        normal = np.ascontiguousarray(np.linalg.eigh(centred.T @ centred)[1][:, 0])
        distances = np.abs((places - middle) @ normal)
        limit, worth = likely(distances, far, 3)
        best = max(best, worth)
        points = places[distances <= _SPREAD * limit]
    return best


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def bulges(patch: Patch, normals: FloatArray, one: Refined, area: float) -> bool:
    """Whether a surface only touches an exact cylinder, as a sphere does: most of what is near leans away from its axis.

    `area` is that of the faces on the cylinder.
    """
    cylinder, faces = one.cylinder, np.arange(len(patch.faces))
    if one.rms > _TOUCHING * CLEAN * cylinder[RADIUS]:
        return False
    near = faces[_following(patch, normals, faces, patch.areas, cylinder, min(FAR, _FAR_OF_RADIUS * cylinder[RADIUS]))]
    lean, around = 0.0, patch.areas[near].sum()
    for f in near:
        tilt = normals[f, 0] * cylinder[3] + normals[f, 1] * cylinder[4] + normals[f, 2] * cylinder[5]
        lean += patch.areas[f] * abs(tilt)
    return bool(area < 0.5 * around and lean > _LEAN * around)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def scored(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, cylinder: FloatArray, far: float) -> float:
    """Area of the faces that follow a cylinder times the digits of their closeness."""
    near, score = _following(patch, normals, chosen, shares, cylinder, far), 0.0
    for s in range(len(chosen)):
        if near[s]:
            off = 0.0
            for k in range(3):
                off = max(off, abs(_distance(patch.points[patch.faces[chosen[s], k]], cylinder)))
            score += shares[s] * max(np.log(far / max(off, 10.0 * EXACT)), 0.0)
    return score


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fading(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, cylinder: FloatArray, noise: float) -> float:
    """Area of the faces that follow a cylinder, fading with their distance for noise of a known size (MSAC)."""
    limit = _NOISE_MAX * noise
    near, total = _following(patch, normals, chosen, shares, cylinder, limit), 0.0
    for s in range(len(chosen)):
        if near[s]:
            square = 0.0
            for k in range(3):
                square += _distance(patch.points[patch.faces[chosen[s], k]], cylinder) ** 2 / 3.0
            total += shares[s] * max(1.0 - square / (limit * limit), 0.0)
    return total


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _distance(point: FloatArray, cylinder: FloatArray) -> float:
    """Of a point from the surface, positive outside."""
    x, y, z = point[0] - cylinder[0], point[1] - cylinder[1], point[2] - cylinder[2]
    along = x * cylinder[3] + y * cylinder[4] + z * cylinder[5]
    x, y, z = x - along * cylinder[3], y - along * cylinder[4], z - along * cylinder[5]
    return np.sqrt(x * x + y * y + z * z) - cylinder[RADIUS]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _following(patch: Patch, normals: FloatArray, chosen: IntArray, shares: FloatArray, cylinder: FloatArray, band: float) -> BoolArray:
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
def _corners(patch: Patch, chosen: IntArray, near: BoolArray) -> IntArray:
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
def _places(patch: Patch, vertices: IntArray) -> FloatArray:
    places = np.empty((len(vertices), 3))
    for i in range(len(vertices)):
        for k in range(3):
            places[i, k] = patch.points[vertices[i], k]
    return places


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
            far[i] = abs(_distance(points[i], cylinder))
        limit = _SPREAD * likely(far, band, 5)[0]
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
            total += _distance(points[order[count - 1 - i if end else i]], cylinder) * cylinder[SIGN]
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
