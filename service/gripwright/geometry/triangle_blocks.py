"""A mesh's triangles in blocks, for one question: up to what length does a convex solid that shrinks touch it?

Of each triangle's part within the solid the greatest s at which it is still touched is a small linear program. Groups of
neighbouring triangles that may be left last come first, and what lies beyond a face at the greatest s so far is passed over.
Seen from a solid that moves it is the mesh that moves, so that the line along which it shrinks may turn.
"""

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.frames import inverse
from gripwright.geometry.rays import morton_order
from gripwright.geometry.withdrawal import Passage, Shrinking

_BLOCK = 16  # triangles; blocks of a group, groups of a region
_FINE_MM = 1e-4  # where several faces move


class TriangleBlocks:
    """A mesh's triangles in blocks of neighbours, blocks in groups and groups in regions, each with its box."""

    def __init__(self, mesh: Mesh) -> None:
        corners = mesh.triangles_mm
        corners = corners[morton_order(corners.mean(axis=1))]
        self._corners: FloatArray = np.ascontiguousarray(corners)
        blocks = _boxes(corners.min(axis=1), corners.max(axis=1))
        groups = _boxes(*blocks)
        self._boxes = (*_centred(*blocks), *_centred(*groups), *_centred(*_boxes(*groups)))

    def last_touch_mm(self, solid: Shrinking, passage: Passage, X_M: FloatArray, start_mm: float, end_mm: float) -> float:
        """The greatest s within [start, end] at which the solid, on its passage, touches the mesh at pose X_M; −inf: none.

        Seen from a solid that turns, each triangle sweeps the hull of where it is at either end of the arc, as much
        larger as the arc of its farthest point leaves the chord.
        """
        X_SM = np.ascontiguousarray(inverse(passage.places) @ X_M)
        axis = np.zeros((2, 3)) if passage.axis is None else (passage.axis - [X_M[:3, 3], np.zeros(3)]) @ X_M[:3, :3]
        planes = (solid.normals, solid.offsets, solid.rates)
        return float(_last_touch(self._corners, *self._boxes, X_SM, axis, passage.bulge, *planes, start_mm, end_mm))


def _boxes(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The boxes around each `_BLOCK` boxes."""
    starts = np.arange(0, len(low), _BLOCK)
    return np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)


def _centred(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    return (low + high) / 2.0, (high - low) / 2.0


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _last_touch(
    corners: FloatArray,
    block_centres: FloatArray,
    block_halves: FloatArray,
    group_centres: FloatArray,
    group_halves: FloatArray,
    region_centres: FloatArray,
    region_halves: FloatArray,
    X_SM: FloatArray,
    axis: FloatArray,
    bulge: float,
    normals: FloatArray,
    offsets: FloatArray,
    rates: FloatArray,
    start: float,
    end: float,
) -> float:
    seen = _seen_from_mesh(X_SM, normals, offsets)
    room = (3 + len(normals), 3)
    whole, part, spare = np.empty(room), np.empty(room), np.empty(room)
    points, slack, corner = np.empty((3 * len(X_SM), 3)), np.empty((len(normals), 3 * len(X_SM))), np.empty((3, 3))
    latest = np.full(len(group_centres), -np.inf)
    for region in range(len(region_centres)):
        if _latest(region_centres[region], region_halves[region], *seen, rates, axis, bulge) < start:
            continue
        for group in range(region * _BLOCK, min((region + 1) * _BLOCK, len(group_centres))):
            latest[group] = _latest(group_centres[group], group_halves[group], *seen, rates, axis, bulge)
    best = -np.inf
    near = np.flatnonzero(latest >= start)
    for group in near[np.argsort(-latest[near])]:
        if latest[group] <= best:
            break
        for block in range(group * _BLOCK, min((group + 1) * _BLOCK, len(block_centres))):
            bound = _latest(block_centres[block], block_halves[block], *seen, rates, axis, bulge)
            if bound < start or bound <= best:
                continue
            for number in range(block * _BLOCK, min((block + 1) * _BLOCK, len(corners))):
                grown = bulge * _arm(corners[number], axis) if bulge > 0.0 else 0.0
                _place(corners[number], X_SM, points)
                bound, touched = _of_points(points, normals, offsets, rates, grown, max(best, start), slack)
                if touched >= start:
                    best = max(best, min(touched, end))
                if best >= end:
                    return end
                if bound < start or bound <= best:
                    continue
                for a in range(len(points) - 2):
                    for b in range(a + 1, len(points) - 1):
                        for c in range(b + 1, len(points)):
                            low = max(best, start)
                            if _of_three(slack, rates, a, b, c) < low:
                                continue
                            corner[0], corner[1], corner[2] = points[a], points[b], points[c]
                            levels = offsets + grown
                            if _clipped(corner, 3, normals, levels - rates * low, part, spare) > 0:
                                best = _greatest(corner, normals, levels, rates, low, end, whole, part, spare)
    return best


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _seen_from_mesh(X_SM: FloatArray, normals: FloatArray, offsets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Faces in the mesh's frame, for each place."""
    seen, levels = np.empty((len(X_SM), len(normals), 3)), np.empty((len(X_SM), len(normals)))
    for k in range(len(X_SM)):
        for i in range(len(normals)):
            levels[k, i] = offsets[i]
            for axis in range(3):
                levels[k, i] -= normals[i, axis] * X_SM[k, axis, 3]
                seen[k, i, axis] = (
                    normals[i, 0] * X_SM[k, 0, axis] + normals[i, 1] * X_SM[k, 1, axis] + normals[i, 2] * X_SM[k, 2, axis]
                )
    return seen, levels


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _latest(
    centre: FloatArray, half: FloatArray, seen: FloatArray, levels: FloatArray, rates: FloatArray, axis: FloatArray, bulge: float
) -> float:
    """A bound on the greatest s at which anything within a box is touched; −inf where it lies beyond a face."""
    grown = 0.0
    if bulge > 0.0:
        grown = bulge * (_radius(centre, axis) + np.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2))
    latest = np.inf
    for i in range(len(rates)):
        slack = -np.inf
        for k in range(len(seen)):
            a, b, c = seen[k, i, 0], seen[k, i, 1], seen[k, i, 2]
            nearest = a * centre[0] + b * centre[1] + c * centre[2] - abs(a) * half[0] - abs(b) * half[1] - abs(c) * half[2]
            slack = max(slack, levels[k, i] - nearest)
        slack += grown
        if rates[i] > 0.0:
            latest = min(latest, slack / rates[i])
        elif slack < 0.0:
            return -np.inf
    return latest


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _radius(point: FloatArray, axis: FloatArray) -> float:
    """Distance of a point from an axis."""
    x, y, z = point[0] - axis[0, 0], point[1] - axis[0, 1], point[2] - axis[0, 2]
    along = x * axis[1, 0] + y * axis[1, 1] + z * axis[1, 2]
    return float(np.sqrt(max(0.0, x * x + y * y + z * z - along * along)))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _arm(triangle: FloatArray, axis: FloatArray) -> float:
    return float(max(_radius(triangle[0], axis), _radius(triangle[1], axis), _radius(triangle[2], axis)))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _place(triangle: FloatArray, X_SM: FloatArray, points: FloatArray) -> None:
    """The triangle's corners as seen from the solid at each place."""
    for k in range(len(X_SM)):
        for corner in range(3):
            for axis in range(3):
                points[3 * k + corner, axis] = (
                    X_SM[k, axis, 0] * triangle[corner, 0]
                    + X_SM[k, axis, 1] * triangle[corner, 1]
                    + X_SM[k, axis, 2] * triangle[corner, 2]
                    + X_SM[k, axis, 3]
                )


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _of_points(
    points: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
    rates: FloatArray,
    grown: float,
    low: float,
    slack: FloatArray,
) -> tuple[float, float]:
    """A bound on s for the hull of points, and the greatest s at which one of them is touched; −inf where it is below `low`.

    `slack` becomes, for each face and point, the s at which the face reaches it; of a face that stays, how far within it is.
    """
    bound = np.inf
    for i in range(len(normals)):
        most = -np.inf
        for k in range(len(points)):
            level = normals[i, 0] * points[k, 0] + normals[i, 1] * points[k, 1] + normals[i, 2] * points[k, 2]
            slack[i, k] = offsets[i] + grown - level
            if rates[i] > 0.0:
                slack[i, k] /= rates[i]
            most = max(most, slack[i, k])
        if rates[i] > 0.0:
            bound = min(bound, most)
        if bound < low or (rates[i] == 0.0 and most < 0.0):
            return -np.inf, -np.inf
    touched = -np.inf
    for k in range(len(points)):
        one = np.inf
        for i in range(len(normals)):
            if rates[i] > 0.0:
                one = min(one, slack[i, k])
            elif slack[i, k] < 0.0:
                one = -np.inf
                break
        touched = max(touched, one)
    return bound, touched


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _of_three(slack: FloatArray, rates: FloatArray, a: int, b: int, c: int) -> float:
    """A bound on s for the triangle of three of the points."""
    bound = np.inf
    for i in range(len(rates)):
        most = max(slack[i, a], slack[i, b], slack[i, c])
        if rates[i] > 0.0:
            bound = min(bound, most)
        elif most < 0.0:
            return -np.inf
    return bound


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _greatest(
    triangle: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
    rates: FloatArray,
    low: float,
    high: float,
    whole: FloatArray,
    part: FloatArray,
    spare: FloatArray,
) -> float:
    """The greatest s up to `high` of a triangle that is touched at `low`."""
    moving = 0
    while moving < len(rates) and rates[moving] > 0.0:
        moving += 1
    count = _clipped(triangle, 3, normals[moving:], offsets[moving:], whole, spare)
    least = low
    for i in range(moving):
        reach = -np.inf
        for k in range(count):
            level = normals[i, 0] * whole[k, 0] + normals[i, 1] * whole[k, 1] + normals[i, 2] * whole[k, 2]
            reach = max(reach, (offsets[i] - level) / rates[i])
        high = min(high, reach)
    if moving == 1 or count == 0:
        return max(high, low)
    while high - least > _FINE_MM:
        middle = (least + high) / 2.0
        if _clipped(whole, count, normals[:moving], offsets[:moving] - rates[:moving] * middle, part, spare) > 0:
            least = middle
        else:
            high = middle
    return max(high, low)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _clipped(
    polygon: FloatArray, count: int, normals: FloatArray, levels: FloatArray, result: FloatArray, spare: FloatArray
) -> int:
    """The part of a polygon with normal · p ≤ level for every face, in `result`; its number of corners (Sutherland, Hodgman)."""
    for k in range(count):
        result[k] = polygon[k]
    for i in range(len(normals)):
        kept = 0
        a, b, c = normals[i, 0], normals[i, 1], normals[i, 2]
        before = a * result[count - 1, 0] + b * result[count - 1, 1] + c * result[count - 1, 2] - levels[i]
        any_beyond = before > 0.0
        for k in range(count):
            here = a * result[k, 0] + b * result[k, 1] + c * result[k, 2] - levels[i]
            any_beyond = any_beyond or here > 0.0
            if (here > 0.0) != (before > 0.0):
                share = before / (before - here)
                last = k - 1 if k > 0 else count - 1
                for axis in range(3):
                    spare[kept, axis] = result[last, axis] + share * (result[k, axis] - result[last, axis])
                kept += 1
            if here <= 0.0:
                spare[kept] = result[k]
                kept += 1
            before = here
        if not any_beyond:
            continue
        if kept == 0:
            return 0
        count = kept
        for k in range(count):
            result[k] = spare[k]
    return count
