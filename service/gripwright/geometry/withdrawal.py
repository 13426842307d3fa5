"""How far a convex solid has to shrink along a line until it touches a mesh no more, exactly.

A hand's palm moves back as its fingers grow, and a stem ends sooner as they shrink: some faces of a convex solid move inwards
with a length s, the others stay. Of each triangle's part within the solid the greatest s at which it is still touched is a
small linear program; groups of neighbouring triangles that may be left last come first, and what lies beyond a face at the
greatest s so far is passed over.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.polytope import Faces
from gripwright.geometry.rays import morton_order

_BLOCK = 16  # triangles; blocks of a group, groups of a region
_STEEP = 1e-9  # faces along the line to within this stay
_FINE_MM = 1e-4  # where several faces move


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shrinking:
    """A convex solid that shrinks as s (mm) grows: normal · p ≤ offset − rate · s, with no rate below 0."""

    normals: FloatArray  # (f, 3)
    offsets: FloatArray  # (f,)
    rates: FloatArray  # (f,)
    centre: FloatArray  # (3,) of a box that holds it for all s
    half: FloatArray  # (3,)


def withdrawn(faces: Faces, direction: FloatArray, length_mm: float) -> Shrinking:
    """A solid that moves by s ≤ `length_mm` along a unit direction, and leaves its back where it is to end up."""
    rates = -faces.normals @ direction
    end = direction * length_mm
    return _shrinking(
        faces,
        rates,
        faces.offsets + length_mm * np.maximum(-rates, 0.0),
        faces.low + np.minimum(end, 0.0),
        faces.high + np.maximum(end, 0.0),
    )


def shortened(faces: Faces, direction: FloatArray) -> Shrinking:
    """A solid whose end that looks along a unit direction moves against it by s."""
    return _shrinking(faces, faces.normals @ direction, faces.offsets, faces.low, faces.high)


def _shrinking(faces: Faces, rates: FloatArray, offsets: FloatArray, low: FloatArray, high: FloatArray) -> Shrinking:
    moving_first = np.argsort(-rates, kind="stable")
    return Shrinking(
        normals=np.ascontiguousarray(faces.normals[moving_first]),
        offsets=offsets[moving_first],
        rates=np.where(rates > _STEEP, rates, 0.0)[moving_first],
        centre=(low + high) / 2.0,
        half=(high - low) / 2.0,
    )


class TriangleBlocks:
    """A mesh's triangles in blocks of neighbours, blocks in groups and groups in regions, each with its box."""

    def __init__(self, mesh: Mesh) -> None:
        corners = mesh.triangles_mm
        corners = corners[morton_order(corners.mean(axis=1))]
        self._corners: FloatArray = np.ascontiguousarray(corners)
        blocks = _boxes(corners.min(axis=1), corners.max(axis=1))
        groups = _boxes(*blocks)
        self._boxes = (*_centred(*blocks), *_centred(*groups), *_centred(*_boxes(*groups)))

    def last_touch_mm(self, solid: Shrinking, X_SM: FloatArray, start_mm: float, end_mm: float) -> float:
        """The greatest s within [start, end] at which the solid touches the mesh, placed at X_SM in its frame; −inf: none."""
        normals = solid.normals @ X_SM[:3, :3]
        offsets = solid.offsets - solid.normals @ X_SM[:3, 3]
        return float(_last_touch(self._corners, *self._boxes, normals, offsets, solid.rates, start_mm, end_mm))


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
    normals: FloatArray,
    offsets: FloatArray,
    rates: FloatArray,
    start: float,
    end: float,
) -> float:
    best = -np.inf
    room = (3 + len(normals), 3)
    whole, part, spare = np.empty(room), np.empty(room), np.empty(room)
    latest = np.full(len(group_centres), -np.inf)
    for region in range(len(region_centres)):
        if _latest(region_centres[region], region_halves[region], normals, offsets, rates) < start:
            continue
        for group in range(region * _BLOCK, min((region + 1) * _BLOCK, len(group_centres))):
            latest[group] = _latest(group_centres[group], group_halves[group], normals, offsets, rates)
    near = np.flatnonzero(latest >= start)
    for group in near[np.argsort(-latest[near])]:
        if latest[group] <= best:
            break
        for block in range(group * _BLOCK, min((group + 1) * _BLOCK, len(block_centres))):
            bound = _latest(block_centres[block], block_halves[block], normals, offsets, rates)
            if bound < start or bound <= best:
                continue
            for number in range(block * _BLOCK, min((block + 1) * _BLOCK, len(corners))):
                corner, bound = _of_corners(corners[number], normals, offsets, rates)
                if corner >= start:
                    best = max(best, min(corner, end))
                if best >= end:
                    return end
                if bound < start or bound <= best:
                    continue
                low = max(best, start)
                if _clipped(corners[number], 3, normals, offsets - rates * low, part, spare) > 0:
                    best = _greatest(corners[number], normals, offsets, rates, low, end, whole, part, spare)
    return best


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _of_corners(triangle: FloatArray, normals: FloatArray, offsets: FloatArray, rates: FloatArray) -> tuple[float, float]:
    """The greatest s at which a triangle's corner is touched (−inf: none is), and a bound on it for the triangle."""
    first, second, third, bound = np.inf, np.inf, np.inf, np.inf
    for i in range(len(normals)):
        a, b, c = normals[i, 0], normals[i, 1], normals[i, 2]
        x = offsets[i] - a * triangle[0, 0] - b * triangle[0, 1] - c * triangle[0, 2]
        y = offsets[i] - a * triangle[1, 0] - b * triangle[1, 1] - c * triangle[1, 2]
        z = offsets[i] - a * triangle[2, 0] - b * triangle[2, 1] - c * triangle[2, 2]
        if rates[i] > 0.0:
            first, second, third = min(first, x / rates[i]), min(second, y / rates[i]), min(third, z / rates[i])
            bound = min(bound, max(x, y, z) / rates[i])
            continue
        if max(x, y, z) < 0.0:
            return -np.inf, -np.inf
        first = first if x >= 0.0 else -np.inf
        second = second if y >= 0.0 else -np.inf
        third = third if z >= 0.0 else -np.inf
    return max(first, second, third), bound


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _latest(centre: FloatArray, half: FloatArray, normals: FloatArray, offsets: FloatArray, rates: FloatArray) -> float:
    """A bound on the greatest s at which anything within a box is touched; −inf where it lies beyond a face."""
    latest = np.inf
    for i in range(len(normals)):
        a, b, c = normals[i, 0], normals[i, 1], normals[i, 2]
        nearest = a * centre[0] + b * centre[1] + c * centre[2] - abs(a) * half[0] - abs(b) * half[1] - abs(c) * half[2]
        if rates[i] > 0.0:
            latest = min(latest, (offsets[i] - nearest) / rates[i])
        elif nearest > offsets[i]:
            return -np.inf
    return latest


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
