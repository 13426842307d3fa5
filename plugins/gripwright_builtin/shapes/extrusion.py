"""Extruded profiles: the primitive and its fitter."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, ClassVar

import numpy as np
import shapely
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import BoolArray, FloatArray, Mesh, Segment
from gripwright.geometry.drawn import extruded
from gripwright.geometry.facets import Facet, facets
from gripwright.geometry.frames import pose_along
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.shapes.outline import is_round, nearest_edge, outline_of, rectangle_share, signed_area

_FACET_RAD = float(np.radians(8.0))
_ALONG, _ACROSS = float(np.sin(np.radians(3.0))), float(np.cos(np.radians(3.0)))
_LARGEST = 8  # facets whose normals, and the directions square to two of them, are tried as the axis
_SAME = 0.9995  # cosine between directions of which one is enough
_END = 0.01  # of the height: so near to an end its face lies


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Extrusion:
    """A polygon led along its normal: the outline lies in the plane x, y of frame B, the profile from z = 0 to `height_mm`."""

    X_CB: FloatArray  # (4, 4)
    outline_B: FloatArray  # (k, 2) corners, counter-clockwise, without holes
    height_mm: float
    internal: bool  # True: a pocket
    ends_filled: FloatArray  # (2,) share of the end faces at z = 0 and z = height that is covered by surface, 0..1
    rms_mm: float
    surface_filled: bool
    kind: str = field(default="extrusion", init=False)

    @property
    def volume_mm3(self) -> float:
        """Area of the outline times the height."""
        return signed_area(self.outline_B) * self.height_mm

    @property
    def axis_C(self) -> FloatArray:
        """Along which it is extruded, unit."""
        return np.asarray(self.X_CB[:3, 2])

    @property
    def center_C(self) -> FloatArray:
        """Half way along the axis, over the outline's centroid."""
        x, y = shapely.get_coordinates(shapely.centroid(shapely.Polygon(self.outline_B)))[0]
        return np.asarray(self.X_CB[:3, :3] @ [x, y, self.height_mm / 2.0] + self.X_CB[:3, 3])

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`; a pocket has no end faces."""
        places, facing = (points_mm - self.X_CB[:3, 3]) @ self.X_CB[:3, :3], normals @ self.X_CB[:3, :3]
        distance, outward = nearest_edge(self.outline_B, places[:, :2])
        sign = -1.0 if self.internal else 1.0
        beyond = np.abs(places[:, 2] - self.height_mm / 2.0) - self.height_mm / 2.0
        side = (distance <= tolerance_mm) & ((facing[:, :2] * outward).sum(axis=1) * sign >= np.cos(angle_rad))
        side &= beyond <= tolerance_mm
        if self.internal:
            return np.asarray(side)
        up = np.where(places[:, 2] > self.height_mm / 2.0, 1.0, -1.0)
        end = (np.abs(beyond) <= tolerance_mm) & (facing[:, 2] * up >= np.cos(angle_rad))
        inside = shapely.contains_xy(shapely.Polygon(self.outline_B), places[:, 0], places[:, 1])
        return np.asarray(side | (end & (inside | (distance <= tolerance_mm))))

    def drawn(self) -> Mesh:
        """See `DrawnPrimitive`."""
        return extruded(self.outline_B, self.X_CB, self.height_mm)

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm."""
        return {
            "outline": self.outline_B.tolist(),
            "height": self.height_mm,
            "axes": self.X_CB[:3, :3].T.tolist(),
            "origin": self.X_CB[:3, 3].tolist(),
            "internal": self.internal,
            "ends_filled": self.ends_filled.tolist(),
            "rms": self.rms_mm,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Along:
    """How a segment looks along an axis."""

    axis: FloatArray  # (3,)
    low_mm: float
    high_mm: float
    sides: Sequence[Facet]
    ends: tuple[Sequence[Facet], Sequence[Facet]]  # at the low and at the high end
    share: float  # of the area that is side or end, 0..1


class ExtrusionParams(Params):
    """What counts as an extruded profile."""

    support_min: float = Field(0.9, gt=0, le=1, description="Least share of the segment's area on the sides and the two ends.")
    filled_min: float = Field(0.35, gt=0, le=1, description="Share of the sides' area from which the surface counts as filled.")
    rectangle_max: float = Field(
        0.995, gt=0, le=1, description="Largest share of its least rectangle that the outline fills; more is a box."
    )
    rms_max: float = Field(
        0.005, gt=0, le=1, description="Largest root mean square distance of the sides from the outline, share of its size."
    )


class ExtrusionFitter:
    """Fits the profile that a segment is led along: any outline that is no circle and no rectangle."""

    key: ClassVar[str] = "extrusion"
    params_model: ClassVar[type[ExtrusionParams]] = ExtrusionParams

    def __init__(self, params: ExtrusionParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Extrusion | Rejection:
        """The extruded profile, or `no-extrusion` with the measured value and the limit."""
        mesh, planes = component.mesh, facets(component.mesh, segment.faces, _FACET_RAD)
        seen = max((_along(mesh, planes, axis) for axis in _axes(planes)), key=lambda one: one.share, default=None)
        if seen is None or not seen.sides:
            return Rejection("no-extrusion", "the segment has no sides along an axis")
        if seen.share < self._params.support_min:
            share, least = 100 * seen.share, 100 * self._params.support_min
            return Rejection(
                "no-extrusion", f"{share:.1f} % of the surface is along an axis or at its ends, at least {least:.1f} %"
            )
        X = pose_along(seen.axis, np.zeros(3))
        flat, sides = mesh.vertices_mm @ X[:3, :2], mesh.faces[np.concatenate([facet.faces for facet in seen.sides])]
        ring = outline_of(seen.ends, sides, flat, mesh.faces)
        if isinstance(ring, str):
            return Rejection("no-extrusion", ring)
        return self._refused(ring) or self._extrusion(seen, ring, X, mesh)

    def _refused(self, ring: FloatArray) -> Rejection | None:
        if is_round(ring):
            return Rejection("no-extrusion", "the outline is a circle, as a cylinder has")
        share = rectangle_share(ring)
        if share > self._params.rectangle_max:
            most = 100 * self._params.rectangle_max
            return Rejection("no-extrusion", f"the outline fills {100 * share:.1f} % of a rectangle, a box; at most {most:.1f} %")
        return None

    def _extrusion(self, seen: _Along, ring: FloatArray, X: FloatArray, mesh: Mesh) -> Extrusion | Rejection:
        faces = np.concatenate([facet.faces for facet in seen.sides])
        corners = mesh.triangles_mm[faces]  # (m, 3, 3)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(cross, axis=1) / 2.0
        distance, outward = nearest_edge(ring, (corners.mean(axis=1) @ X[:3, :2]))
        rms, size = float(np.sqrt(np.average(distance**2, weights=areas))), float(np.ptp(ring, axis=0).max())
        if rms > self._params.rms_max * size:
            limit = self._params.rms_max * size
            return Rejection("no-extrusion", f"the sides deviate by {rms:.3g} mm from the outline, at most {limit:.3g} mm")
        height, area = seen.high_mm - seen.low_mm, signed_area(ring)
        girth = float(np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1).sum())
        X = X.copy()
        X[:3, 3] = X[:3, 2] * seen.low_mm
        return Extrusion(
            X_CB=X,
            outline_B=ring,
            height_mm=height,
            internal=bool(((cross @ X[:3, :2]) * outward).sum() < 0.0),
            ends_filled=np.array([min(sum(facet.area_mm2 for facet in end) / area, 1.0) for end in seen.ends]),
            rms_mm=rms,
            surface_filled=bool(areas.sum() >= self._params.filled_min * girth * height),
        )


def _axes(planes: Sequence[Facet]) -> Iterator[FloatArray]:
    """Directions that may be the axis: across a large facet, or along two."""
    largest = np.array([facet.normal for facet in planes[:_LARGEST]]).reshape(-1, 3)
    crossed = [np.cross(a, b) for a, b in combinations(largest, 2)]
    tried: list[FloatArray] = []
    for direction in [*largest, *crossed]:
        length = float(np.linalg.norm(direction))
        if length > 0.1 and all(abs(direction @ other) < _SAME * length for other in tried):
            tried.append(direction / length)
            yield tried[-1]


def _along(mesh: Mesh, planes: Sequence[Facet], axis: FloatArray) -> _Along:
    """Sides and ends along an axis that is turned until the sides lie along it as well as they can."""
    normals, areas = np.array([facet.normal for facet in planes]), np.array([facet.area_mm2 for facet in planes])
    tilt = normals @ axis
    side = np.abs(tilt) <= _ALONG
    if side.sum() >= 2:
        n = normals[side]
        values, vectors = np.linalg.eigh((n * areas[side, None]).T @ n)
        if values[1] > 1e-3 * values[2]:  # else all sides face along one line, and do not tell
            axis = vectors[:, 0] * np.sign(vectors[:, 0] @ axis)
            tilt = normals @ axis
    sides = [facet for facet, on in zip(planes, np.abs(tilt) <= _ALONG, strict=True) if on]
    if not sides:
        return _Along(axis=axis, low_mm=0.0, high_mm=0.0, sides=(), ends=((), ()), share=0.0)
    along = mesh.vertices_mm[mesh.faces[np.concatenate([facet.faces for facet in sides])]] @ axis
    low, high = float(along.min()), float(along.max())
    near = _END * (high - low)
    foot = [f for f, t in zip(planes, tilt, strict=True) if abs(t) >= _ACROSS and abs(f.offset_mm * np.sign(t) - low) <= near]
    head = [f for f, t in zip(planes, tilt, strict=True) if abs(t) >= _ACROSS and abs(f.offset_mm * np.sign(t) - high) <= near]
    on = sum(facet.area_mm2 for facet in (*sides, *foot, *head))
    return _Along(axis=axis, low_mm=low, high_mm=high, sides=sides, ends=(foot, head), share=on / float(areas.sum()))
