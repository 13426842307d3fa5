"""How much of a cylinder's lateral surface is really there: extent, area, arc, and whether three fingers find it. Compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray
from gripwright.geometry.surfaces import perpendiculars
from gripwright_builtin.fitters.patch import Patch

_BINS = 360  # about the axis; a multiple of three
_TURN = 2.0 * np.pi
FACET_MAX_RAD = float(np.radians(40.0))
"""A wider flat, seen from the axis, is no facet of a tessellated cylinder: nine sides are round, eight are not."""
TILT_MAX = 0.7
"""Largest part of a lateral face's normal along the axis; noise tilts it, an end face has 1."""
TILT_EXACT = 0.02
_OUTWARDS_MIN = 0.5
_FACET_MIN = float(np.radians(6.0))


class Lateral(NamedTuple):
    """The part of a segment that lies on a cylinder; lengths are shares of the patch's size, area 0: nothing lies on it."""

    area: float
    low: float  # along the axis, from the cylinder's point
    high: float
    arc_rad: float
    filled: float  # share of the lateral area between low and high, 0..1
    three_finger: float  # share of the height that each of three fingers 120° apart finds at the best rotation, 0..1


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def weighted_median(values: FloatArray, weights: FloatArray) -> float:
    """The least value up to which half of the weight lies."""
    order = np.argsort(values)
    half, total = weights.sum() / 2.0, 0.0
    for i in order:
        total += weights[i]
        if total >= half:
            return float(values[i])
    return float(values[order[-1]])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def angles_about(points: FloatArray, cylinder: FloatArray) -> FloatArray:
    """Angle of points (n, 3) about a cylinder's axis, −π..π, (n,)."""
    frame, angles = np.empty((2, 3)), np.empty(len(points))
    perpendiculars(cylinder[3:6], frame)
    for i in range(len(points)):
        x, y = 0.0, 0.0
        for k in range(3):
            x += (points[i, k] - cylinder[k]) * frame[0, k]
            y += (points[i, k] - cylinder[k]) * frame[1, k]
        angles[i] = np.arctan2(y, x)
    return angles


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def width_of(angles: FloatArray, a: int, b: int, c: int) -> tuple[float, float]:
    """Start (0..2π) and width of a face's angle about the axis, from the angles of its corners, −π..π."""
    ahead, behind = angles[b] - angles[a], angles[c] - angles[a]
    ahead -= _TURN * np.rint(ahead / _TURN)
    behind -= _TURN * np.rint(behind / _TURN)
    first = min(0.0, ahead, behind)
    start = angles[a] + first
    return start + _TURN if start < 0.0 else start, max(0.0, ahead, behind) - first


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def longest_run(angles_rad: FloatArray, gap_rad: float) -> float:
    """The widest angle about the axis without a gap between the given ones that is larger than `gap_rad`."""
    turned = np.sort(angles_rad)
    widest, at = 0.0, 0
    for i in range(len(turned)):  # begin after the widest gap
        gap = turned[i] - turned[i - 1] if i else turned[0] + _TURN - turned[-1]
        if gap > widest:
            widest, at = gap, i
    run, longest = 0.0, 0.0
    for i in range(1, len(turned)):
        here, before = (at + i) % len(turned), (at + i - 1) % len(turned)
        gap = turned[here] - turned[before] + (_TURN if here < before else 0.0)
        run = run + gap if gap <= gap_rad else 0.0
        longest = max(longest, run)
    return float(longest + (widest if widest <= gap_rad else 0.0))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def facet_width_rad(angles_rad: FloatArray) -> float:
    """Typical angle between neighbouring columns of corners about the axis: the median over the surface they span.

    0 where there are no two facets side by side, each at most `FACET_MAX_RAD` wide: then the corners are those of a prism.
    """
    turned = np.sort(angles_rad)
    gaps = np.empty(len(turned))
    for i in range(len(turned)):
        gaps[i] = turned[i + 1] - turned[i] if i + 1 < len(turned) else turned[0] + _TURN - turned[i]
    narrow = np.sort(gaps[gaps <= FACET_MAX_RAD])
    half, total, typical = narrow.sum() / 2.0, 0.0, 0.0
    if not half > 0.0:
        return 0.0
    for gap in narrow:
        total += gap
        if total >= half:
            typical = gap
            break
    facets = gaps[gaps > 0.25 * typical]  # in order about the axis; smaller gaps lie within a column
    if len(facets) <= 2:
        return 0.0
    before = facets[-1]
    for gap in facets:
        if gap <= FACET_MAX_RAD and before <= FACET_MAX_RAD:
            return float(typical)
        before = gap
    return 0.0


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def lateral_surface(
    patch: Patch, normals: FloatArray, cylinder: FloatArray, tolerance: float, facet_rad: float, rms: float
) -> Lateral:
    """The faces that lie on a cylinder and face as it does.

    `tolerance` bounds the distance of a face's corners from the surface; chords of facets of `facet_rad` may lie deeper.
    """
    radius, sign = cylinder[6], cylinder[7]
    deep = tolerance + radius * (1.0 - np.cos(facet_rad * 0.55))
    angles = angles_about(patch.points, cylinder)
    along, off = np.empty(len(patch.points)), np.empty(len(patch.points))
    for v in range(len(patch.points)):
        x, y, z = patch.points[v, 0] - cylinder[0], patch.points[v, 1] - cylinder[1], patch.points[v, 2] - cylinder[2]
        along[v] = x * cylinder[3] + y * cylinder[4] + z * cylinder[5]
        off[v] = np.sqrt(max(x * x + y * y + z * z - along[v] * along[v], 0.0)) - radius
    on, tilts = np.empty(len(patch.faces), np.int64), np.empty(len(patch.faces))
    count = 0
    for f in range(len(patch.faces)):
        a, b, c = patch.faces[f, 0], patch.faces[f, 1], patch.faces[f, 2]
        if max(off[a], off[b], off[c]) > tolerance or min(off[a], off[b], off[c]) < -deep:
            continue
        nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
        tilt = nx * cylinder[3] + ny * cylinder[4] + nz * cylinder[5]
        x = (patch.points[a, 0] + patch.points[b, 0] + patch.points[c, 0]) / 3.0 - cylinder[0]
        y = (patch.points[a, 1] + patch.points[b, 1] + patch.points[c, 1]) / 3.0 - cylinder[1]
        z = (patch.points[a, 2] + patch.points[b, 2] + patch.points[c, 2]) / 3.0 - cylinder[2]
        height = x * cylinder[3] + y * cylinder[4] + z * cylinder[5]
        reach = np.sqrt(max(x * x + y * y + z * z - height * height, 1e-300))
        if abs(tilt) < TILT_MAX and (x * nx + y * ny + z * nz - height * tilt) * sign > _OUTWARDS_MIN * reach:
            on[count], tilts[count] = f, abs(tilt)
            count += 1
    if count == 0:
        return Lateral(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    limit = 3.0 * weighted_median(tilts[:count], patch.areas[on[:count]]) + TILT_EXACT
    facing, widest = on[:count][tilts[:count] <= limit], max(1.5 * facet_rad + 6.0 * rms / radius, _FACET_MIN)
    found: Lateral = _spread(patch, facing, angles, along, radius, widest)
    return found


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _spread(patch: Patch, on: FloatArray, angles: FloatArray, along: FloatArray, radius: float, widest: float) -> Lateral:
    """Extent and cover of some faces, those wider than `widest` left out."""
    starts, widths = np.empty(len(on)), np.empty(len(on))
    density = np.zeros(2 * _BINS + 2)
    low, high, area, count = np.inf, -np.inf, 0.0, 0
    for f in on:
        a, b, c = patch.faces[f, 0], patch.faces[f, 1], patch.faces[f, 2]
        starts[count], widths[count] = width_of(angles, a, b, c)
        if widths[count] > widest:
            continue
        low = min(low, along[a], along[b], along[c])
        high = max(high, along[a], along[b], along[c])
        area += patch.areas[f]
        wide = max(widths[count], 1e-9)
        for edge in range(2):
            at = (starts[count] + edge * wide) / (_TURN / _BINS)
            cell = int(at)
            change = (1.0 - 2.0 * edge) * patch.areas[f] / radius / wide
            density[cell] += change * (1.0 - (at - cell))
            density[cell + 1] += change * (at - cell)
        count += 1
    if count == 0:
        return Lateral(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    cover = np.cumsum(density)
    height = max(high - low, 1e-300)
    filled, fingers = 0.0, 0.0
    for i in range(_BINS // 3):
        least = 1.0
        for k in range(3):
            at = i + k * (_BINS // 3)
            here = min((cover[at] + cover[at + _BINS]) / height, 1.0)
            filled += here / _BINS
            least = min(least, here)
        fingers = max(fingers, least)
    return Lateral(area, low, high, _union(starts[:count], widths[:count]), filled, fingers)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _union(starts: FloatArray, widths: FloatArray) -> float:
    """Length of the union of angular intervals, at most 2π."""
    reach = 0.0
    for i in range(len(starts)):
        reach = max(reach, starts[i] + widths[i] - _TURN)  # what goes over covers the beginning
    total = min(reach, _TURN)
    for i in np.argsort(starts):
        end = min(starts[i] + widths[i], _TURN)
        if end > reach:
            total += end - max(starts[i], reach)
            reach = end
    return float(total)
