"""How much of a cylinder's lateral surface is really there: extent, area, arc, and whether three fingers find it."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray
from gripwright.geometry.frames import any_perpendicular
from gripwright.geometry.surfaces import CylinderFit

_BINS = 360  # about the axis; a multiple of three
_TURN = 2.0 * np.pi
FACET_MAX_RAD = float(np.radians(40.0))
"""A wider flat, seen from the axis, is no facet of a tessellated cylinder: nine sides are round, eight are not."""
TILT_MAX = 0.7
"""Largest part of a lateral face's normal along the axis; noise tilts it, an end face has 1."""
_TILT_EXACT = 0.02
_OUTWARDS_MIN = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceSet:
    """The faces of a segment, as the fit looks at them."""

    triangles_mm: FloatArray  # (k, 3, 3)
    centres_mm: FloatArray  # (k, 3)
    normals: FloatArray  # (k, 3)
    areas_mm2: FloatArray  # (k,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lateral:
    """The part of a segment that lies on a cylinder."""

    faces: BoolArray  # (k,)
    area_mm2: float
    low_mm: float  # along the axis, from the fit's point
    high_mm: float
    arc_rad: float
    filled: float  # share of the lateral area between low and high, 0..1
    three_finger: float  # share of the height that each of three fingers 120° apart finds at the best rotation, 0..1


def facet_width_rad(angles_rad: FloatArray) -> float:
    """Typical angle between neighbouring columns of corners about the axis: the median over the surface they span.

    0 where there are no two facets side by side, each at most `FACET_MAX_RAD` wide: then the corners are those of a prism.
    """
    turned = np.sort(np.mod(angles_rad, _TURN))
    gaps = np.diff(np.append(turned, turned[0] + _TURN))
    narrow = np.sort(gaps[gaps <= FACET_MAX_RAD])
    if not narrow.sum() > 0:
        return 0.0
    typical = float(narrow[np.searchsorted(np.cumsum(narrow), narrow.sum() / 2.0)])
    facets = gaps[gaps > 0.25 * typical] <= FACET_MAX_RAD  # in order about the axis; smaller gaps lie within a column
    return typical if (facets & np.roll(facets, 1)).any() and len(facets) > 2 else 0.0


def lateral_surface(faces: FaceSet, fit: CylinderFit, sign: float, tolerance_mm: float, facet_rad: float) -> Lateral | None:
    """The faces that lie on the cylinder with their normals away from its axis (sign +1) or towards it (−1).

    `tolerance_mm` bounds the distance of a face's corners from the surface; chords of facets of `facet_rad` may lie deeper.
    None where there are none.
    """
    deep = tolerance_mm + fit.radius_mm * (1.0 - np.cos(facet_rad * 0.55))
    distances = fit.distances_mm(faces.triangles_mm.reshape(-1, 3)).reshape(-1, 3)  # (k, 3)
    radial = fit.radial_mm(faces.centres_mm)
    outwards = (faces.normals * radial).sum(axis=1) / np.maximum(np.linalg.norm(radial, axis=1), 1e-300)
    on = (distances <= tolerance_mm).all(axis=1) & (distances >= -deep).all(axis=1)
    tilt = np.abs(faces.normals @ fit.axis)
    on = upright(on & (outwards * sign > _OUTWARDS_MIN) & (tilt < TILT_MAX), tilt, faces.areas_mm2)
    starts, widths = _angles(faces.triangles_mm[on], fit)
    narrow = widths <= max(1.5 * facet_rad, np.radians(6.0))
    on[np.flatnonzero(on)[~narrow]] = False
    starts, widths = starts[narrow], widths[narrow]
    if not on.any():
        return None
    along = (faces.triangles_mm[on] - fit.point_mm) @ fit.axis  # (l, 3)
    low, high = float(along.min()), float(along.max())
    height = max(high - low, 1e-300)
    areas = faces.areas_mm2[on]
    covered = np.minimum(_covered_height(starts, widths, areas / fit.radius_mm) / height, 1.0)  # (bins,)
    thirds = covered.reshape(3, -1)
    return Lateral(
        faces=on,
        area_mm2=float(areas.sum()),
        low_mm=low,
        high_mm=high,
        arc_rad=_union(starts, widths),
        filled=float(covered.mean()),
        three_finger=float(thirds.min(axis=0).max()),
    )


def upright(chosen: BoolArray, tilt: FloatArray, areas_mm2: FloatArray) -> BoolArray:
    """The chosen faces that tilt no more than noise explains: half of their area says how much that is."""
    if not chosen.any():
        return chosen
    return np.asarray(chosen & (tilt <= 3.0 * weighted_median(tilt[chosen], areas_mm2[chosen]) + _TILT_EXACT))


def weighted_median(values: FloatArray, weights: FloatArray) -> float:
    """The value below which half of the weight lies."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(total, total[-1] / 2.0)]])


def angles_about(points_mm: FloatArray, fit: CylinderFit) -> FloatArray:
    """Angle of points (…, 3) about the axis, −π..π."""
    e1 = any_perpendicular(fit.axis)
    v = points_mm - fit.point_mm
    return np.asarray(np.arctan2(v @ np.cross(fit.axis, e1), v @ e1))


def _angles(triangles_mm: FloatArray, fit: CylinderFit) -> tuple[FloatArray, FloatArray]:
    """Start (0..2π) and width of each triangle's angle about the axis, (k,) each."""
    angles = angles_about(triangles_mm, fit)  # (k, 3)
    around = np.mod(angles - angles[:, :1] + np.pi, _TURN) - np.pi  # relative to the first corner
    return np.mod(angles[:, 0] + around.min(axis=1), _TURN), np.ptp(around, axis=1)


def _covered_height(starts: FloatArray, widths: FloatArray, areas: FloatArray) -> FloatArray:
    """Mean height of the surface over each bin about the axis, (bins,); `areas` are divided by the radius."""
    step = _TURN / _BINS
    widths = np.maximum(widths, 1e-9)
    density = areas / widths
    total = np.zeros(2 * _BINS + 2)
    for edge, change in ((starts, density), (starts + widths, -density)):
        at = edge / step
        cell = at.astype(np.int64)
        part = at - cell
        total += np.bincount(cell, change * (1.0 - part), len(total)) + np.bincount(cell + 1, change * part, len(total))
    height = np.cumsum(total)[: 2 * _BINS]
    return np.asarray(height[:_BINS] + height[_BINS:])


def _union(starts: FloatArray, widths: FloatArray) -> float:
    """Length of the union of angular intervals, at most 2π."""
    ends = starts + widths
    over = ends > _TURN
    starts = np.concatenate([starts, np.zeros(int(over.sum()))])
    ends = np.concatenate([np.minimum(ends, _TURN), ends[over] - _TURN])
    order = np.argsort(starts)
    starts, ends = starts[order], ends[order]
    reach = np.maximum.accumulate(np.concatenate([[0.0], ends[:-1]]))
    return float(np.maximum(ends - np.maximum(starts, reach), 0.0).sum())
