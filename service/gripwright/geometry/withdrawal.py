"""How far a convex solid has to shrink along a line until it touches a mesh no more, exactly.

A hand's palm moves back as its fingers grow, and a stem ends sooner as they shrink: some faces of a convex solid move inwards
with a length s, the others stay. Of each triangle's part within the solid the greatest s at which it is still touched is a
small linear program; blocks of neighbouring triangles that lie beyond a face at the greatest s so far are passed over.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.polytope import Faces
from gripwright.geometry.rays import morton_order

_BLOCK = 16  # triangles, and blocks of a group
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
    """A mesh's triangles in blocks of neighbours, and blocks in groups, each with its box."""

    def __init__(self, mesh: Mesh) -> None:
        corners = mesh.triangles_mm
        corners = corners[morton_order(corners.mean(axis=1))]
        self._corners: FloatArray = np.ascontiguousarray(corners)
        blocks = _boxes(corners.min(axis=1), corners.max(axis=1))
        self._blocks, self._groups = _centred(*blocks), _centred(*_boxes(*blocks))

    def last_touch_mm(self, solid: Shrinking, X_SM: FloatArray, start_mm: float, end_mm: float) -> float:
        """The greatest s within [start, end] at which the solid touches the mesh, placed at X_SM in its frame; −inf: none."""
        normals = solid.normals @ X_SM[:3, :3]
        offsets = solid.offsets - solid.normals @ X_SM[:3, 3]
        return float(_last_touch(self._corners, *self._blocks, *self._groups, normals, offsets, solid.rates, start_mm, end_mm))


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
    normals: FloatArray,
    offsets: FloatArray,
    rates: FloatArray,
    start: float,
    end: float,
) -> float:
    levels = offsets - rates * start  # of the faces at the greatest s so far
    best = -np.inf
    room = (3 + len(normals), 3)
    whole, part, spare = np.empty(room), np.empty(room), np.empty(room)
    for group in range(len(group_centres)):
        if _beyond(group_centres[group], group_halves[group], normals, levels):
            continue
        for block in range(group * _BLOCK, min((group + 1) * _BLOCK, len(block_centres))):
            if _beyond(block_centres[block], block_halves[block], normals, levels):
                continue
            for number in range(block * _BLOCK, min((block + 1) * _BLOCK, len(corners))):
                if _clipped(corners[number], 3, normals, levels, part, spare) == 0:
                    continue
                best = _greatest(corners[number], normals, offsets, rates, max(best, start), end, whole, part, spare)
                if best >= end:
                    return end
                levels = offsets - rates * best
    return best


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _beyond(centre: FloatArray, half: FloatArray, normals: FloatArray, levels: FloatArray) -> bool:
    """Whether a box lies beyond one of the faces."""
    for i in range(len(normals)):
        a, b, c = normals[i, 0], normals[i, 1], normals[i, 2]
        nearest = a * centre[0] + b * centre[1] + c * centre[2] - abs(a) * half[0] - abs(b) * half[1] - abs(c) * half[2]
        if nearest > levels[i]:
            return True
    return False


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
    """The part of a polygon with normal · p ≤ level for every face, in `result`; the number of its corners (Sutherland, Hodgman)."""
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
