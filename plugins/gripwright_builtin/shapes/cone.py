"""Cones and frusta of cones: the primitive and its fitter."""

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import BoolArray, FloatArray, Mesh, Segment
from gripwright.geometry.drawn import revolved
from gripwright.geometry.frames import pose_along
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.shapes.around import arc, spans, three_finger_share
from gripwright_builtin.shapes.cone_form import ConeForm, cone_forms
from gripwright_builtin.shapes.consensus import Found, consensus
from gripwright_builtin.shapes.ends import covered_share
from gripwright_builtin.shapes.patches import FlatPatches, flat_patches

_COSINE = float(np.cos(np.radians(20.5)))  # half a facet: nine sides are round, eight are not
_GLANCE = 20  # proposals that tell what the surface is instead
_POINTED = 0.01  # of the foot's radius


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cone:
    """A cone or a frustum of one: `center_C` is the midpoint of its axis, `axis_C` points from the foot to the narrow end."""

    center_C: FloatArray  # (3,)
    axis_C: FloatArray  # (3,) unit
    radius_mm: float  # of the foot, the wide end
    radius_top_mm: float  # of the narrow end, 0: it has its apex
    height_mm: float  # full, along the axis
    internal: bool  # True: a conical bore
    arc_rad: float  # angle about the axis that is covered by surface, 0..2π
    ends_filled: FloatArray  # (2,) share of the foot's and the narrow end's disc that is covered by surface, 0..1
    rms_mm: float
    surface_filled: bool
    kind: str = field(default="cone", init=False)

    @property
    def half_angle_rad(self) -> float:
        """Between the axis and the surface, 0..π/2."""
        return float(np.arctan2(self.radius_mm - self.radius_top_mm, self.height_mm))

    @property
    def contact_radius_mm(self) -> float:
        """See `CurvedPrimitive`: half way up."""
        return float((self.radius_mm + self.radius_top_mm) / 2.0 / np.cos(self.half_angle_rad))

    @property
    def truncated(self) -> bool:
        """Whether it is a frustum."""
        return self.radius_top_mm > _POINTED * self.radius_mm

    @property
    def volume_mm3(self) -> float:
        """π h (R² + R r + r²) / 3."""
        wide, narrow = self.radius_mm, self.radius_top_mm
        return float(np.pi * self.height_mm * (wide**2 + wide * narrow + narrow**2) / 3.0)

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`; chords of `angle_rad` lie deeper, and a bore has no end faces."""
        sign, cosine = (-1.0 if self.internal else 1.0), np.cos(self.half_angle_rad)
        along = (points_mm - self.center_C) @ self.axis_C  # (n,)
        radial = points_mm - self.center_C - np.outer(along, self.axis_C)
        distance = np.linalg.norm(radial, axis=1)
        radius = (self.radius_mm + self.radius_top_mm) / 2.0 - np.tan(self.half_angle_rad) * along
        depth = (radius - distance) * cosine
        beyond = np.abs(along) - self.height_mm / 2.0
        across = (normals * radial).sum(axis=1) / np.maximum(distance, 1e-300) * cosine
        turned = sign * (across + (normals @ self.axis_C) * np.sin(self.half_angle_rad)) >= np.cos(angle_rad)
        chord_mm = np.abs(radius) * (1.0 - np.cos(angle_rad))
        lateral = turned & (depth >= -tolerance_mm) & (depth <= tolerance_mm + chord_mm) & (beyond <= tolerance_mm)
        end = (np.abs(beyond) <= tolerance_mm) & (depth >= -tolerance_mm)
        end &= normals @ self.axis_C * np.sign(along) >= np.cos(angle_rad)
        return np.asarray(lateral if self.internal else lateral | end)

    def drawn(self) -> Mesh:
        """See `DrawnPrimitive`."""
        half = self.height_mm / 2.0
        profile = np.array([[0.0, -half], [self.radius_mm, -half], [self.radius_top_mm, half], [0.0, half]])
        return revolved(profile if self.truncated else profile[[0, 1, 3]], pose_along(self.axis_C, self.center_C))

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm and degrees."""
        return {
            "radius": self.radius_mm,
            "radius_top": self.radius_top_mm,
            "height": self.height_mm,
            "half_angle": float(np.degrees(self.half_angle_rad)),
            "truncated": self.truncated,
            "axis": self.axis_C.tolist(),
            "center": self.center_C.tolist(),
            "internal": self.internal,
            "arc": float(np.degrees(self.arc_rad)),
            "ends_filled": self.ends_filled.tolist(),
            "rms": self.rms_mm,
        }


class ConeParams(Params):
    """What counts as a cone."""

    half_angle_min: float = Field(0.2, gt=0, lt=45, description="Least half angle, degrees; a more slender one is a cylinder.")
    half_angle_max: float = Field(60.0, gt=45, le=80, description="Largest half angle, degrees; a wider one is nearly flat.")
    support_min: float = Field(
        0.2, gt=0, le=1, description="Least share of the segment's area, faces across the axis left out, on the cone."
    )
    filled_min: float = Field(0.35, ge=0, le=1, description="Share of the lateral area from which the surface counts as filled.")
    three_finger_min: float = Field(
        0.25, ge=0, le=1, description="Share of the surface that each of three fingers, 120 degrees apart, must find."
    )
    rms_max: float = Field(0.006, gt=0, le=1, description="Largest root mean square distance, as a share of the mean radius.")


class ConeFitter:
    """Fits the cone or the frustum of a cone that most of a segment follows, outside or as a conical bore."""

    key: ClassVar[str] = "cone"
    params_model: ClassVar[type[ConeParams]] = ConeParams

    def __init__(self, params: ConeParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Cone | Rejection:
        """The cone, or `no-cone` with what was found instead."""
        patches = flat_patches(component.mesh, segment.faces)
        slopes = np.tan(np.radians([self._params.half_angle_min, self._params.half_angle_max]))
        forms = cone_forms(patches, ctx.rng)
        tapered = [form for form in forms if slopes[0] <= abs(form.slope) <= slopes[1]]
        found = consensus(patches, tapered, _COSINE)
        if found is None or not slopes[0] <= abs(found.form.slope) <= slopes[1]:
            return self._no_taper(consensus(patches, forms[:_GLANCE], _COSINE))
        refused = self._refused(found, patches)
        return refused or self._cone(found, patches)

    def _no_taper(self, other: Found[ConeForm] | None) -> Rejection:
        """Why nothing follows a cone of such an angle."""
        if other is None:
            return Rejection("no-cone", "no part of the surface follows a cone")
        angle = float(np.degrees(np.arctan(abs(other.form.slope))))
        if angle < self._params.half_angle_min:
            least = self._params.half_angle_min
            return Rejection("no-cone", f"a cone of half angle {angle:.2f}° is a cylinder, at least {least:.2f}° needed")
        if angle > self._params.half_angle_max:
            return Rejection(
                "no-cone", f"a cone of half angle {angle:.1f}° is nearly flat, at most {self._params.half_angle_max:.1f}°"
            )
        return Rejection("no-cone", "no part of the surface follows a cone")

    def _refused(self, found: Found[ConeForm], patches: FlatPatches) -> Rejection | None:
        around = float(patches.areas @ (np.abs(patches.normals @ found.form.axis) < np.cos(np.radians(3.0))))
        share = float(patches.areas[found.near].sum()) / max(around, 1e-300)
        if share < self._params.support_min:
            return Rejection(
                "no-cone",
                f"{100 * share:.1f} % of the surface around the axis lies on the best cone, "
                f"at least {100 * self._params.support_min:.1f} % needed",
            )
        along = (patches.centres[found.near] - found.form.point) @ found.form.axis
        radius = float(np.abs(found.form.radius + found.form.slope * along).mean())
        size, limit = patches.size_mm, self._params.rms_max * radius
        if found.rms > limit:
            return Rejection(
                "no-cone", f"the surface deviates by {found.rms * size:.3g} mm from a cone, at most {limit * size:.3g} mm"
            )
        return None

    def _cone(self, found: Found[ConeForm], patches: FlatPatches) -> Cone:
        form, chosen = found.form.narrowing, patches.select(found.near)
        along = (chosen.points - form.point) @ form.axis
        low, high = float(along.min()), float(along.max())
        wide, narrow = form.radius + form.slope * low, max(form.radius + form.slope * high, 0.0)
        if narrow <= _POINTED * wide:
            narrow, high = 0.0, -form.radius / form.slope
        lateral = np.pi * (wide + narrow) * np.hypot(high - low, wide - narrow)
        begin, end = spans(chosen, form.point, form.axis)
        filled = float(chosen.areas.sum()) / lateral >= self._params.filled_min
        held = three_finger_share(begin, end, chosen.areas, lateral) >= self._params.three_finger_min
        discs = [(low, -1.0, wide), (high, 1.0, narrow)]
        return Cone(
            center_C=patches.place_mm(form.point + form.axis * (low + high) / 2.0),
            axis_C=form.axis,
            radius_mm=wide * patches.size_mm,
            radius_top_mm=narrow * patches.size_mm,
            height_mm=(high - low) * patches.size_mm,
            internal=found.sign < 0,
            arc_rad=arc(begin, end)[1],
            ends_filled=np.array(
                [covered_share(patches, form.axis * sign, form.point + form.axis * at, np.pi * r**2) for at, sign, r in discs]
            ),
            rms_mm=found.rms * patches.size_mm,
            surface_filled=bool(filled and held),
        )
