"""Segments of tori: the primitive and its fitter."""

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import BoolArray, FloatArray, Mesh, Segment
from gripwright.geometry.drawn import revolved
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.shapes.around import arc, spans
from gripwright_builtin.shapes.consensus import Found, consensus
from gripwright_builtin.shapes.patches import FlatPatches, flat_patches
from gripwright_builtin.shapes.torus_form import TorusForm, torus_forms

_COSINE = float(np.cos(np.radians(24.0)))  # half the diagonal of a facet
_LEAST = 8  # patches
_TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Torus:
    """A tube about a circle, or about an arc of one: a ring, a pipe bend. Its own hole is wider than nothing."""

    center_C: FloatArray  # (3,) of the circle
    axis_C: FloatArray  # (3,) unit, across the circle's plane
    start_C: FloatArray  # (3,) unit, from the centre to where the arc begins; it goes counter-clockwise about the axis
    arc_rad: float  # 0..2π
    major_radius_mm: float  # of the circle
    minor_radius_mm: float  # of the tube
    internal: bool  # True: the inside of a tube
    rms_mm: float
    surface_filled: bool
    kind: str = field(default="torus", init=False)

    @property
    def volume_mm3(self) -> float:
        """π r² · R · arc."""
        return float(np.pi * self.minor_radius_mm**2 * self.major_radius_mm * self.arc_rad)

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`; chords of `angle_rad` lie deeper, and the inside of a tube has no end faces."""
        form = TorusForm(point=self.center_C, axis=self.axis_C, major=self.major_radius_mm, minor=self.minor_radius_mm)
        away = form.from_circle(points_mm)
        distance, sign = np.linalg.norm(away, axis=1), -1.0 if self.internal else 1.0
        depth = self.minor_radius_mm - distance
        turned = (normals * away).sum(axis=1) * sign >= np.cos(angle_rad) * distance
        outer_mm = self.minor_radius_mm + self.major_radius_mm  # chords along the ring lie deeper than those around the tube
        chord_mm = outer_mm * (1.0 - np.cos(angle_rad / 2.0))
        close = (depth >= -tolerance_mm) & (depth <= tolerance_mm + chord_mm)
        v = points_mm - self.center_C
        angle = np.arctan2(v @ np.cross(self.axis_C, self.start_C), v @ self.start_C)
        past = np.mod(angle + tolerance_mm / self.major_radius_mm, _TURN) * self.major_radius_mm - tolerance_mm  # along the arc
        length_mm = self.arc_rad * self.major_radius_mm
        tube = turned & close & (past <= length_mm + tolerance_mm)
        tangent = np.cross(self.axis_C, v)
        facing = (normals * tangent).sum(axis=1) / np.maximum(np.linalg.norm(tangent, axis=1), 1e-300)
        end = (np.abs(past) <= tolerance_mm) & (facing <= -np.cos(angle_rad))
        end |= (np.abs(past - length_mm) <= tolerance_mm) & (facing >= np.cos(angle_rad))
        return np.asarray(tube if self.internal else tube | (end & (depth >= -tolerance_mm)))

    def drawn(self) -> Mesh:
        """See `DrawnPrimitive`."""
        turns = np.linspace(0.0, _TURN, 64, endpoint=False)
        circle = self.minor_radius_mm * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        X = pose(self.start_C, np.cross(self.axis_C, self.start_C), self.axis_C, self.center_C)
        return revolved(circle + np.array([self.major_radius_mm, 0.0]), X, self.arc_rad)

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm and degrees."""
        return {
            "major_radius": self.major_radius_mm,
            "minor_radius": self.minor_radius_mm,
            "arc": float(np.degrees(self.arc_rad)),
            "axis": self.axis_C.tolist(),
            "start": self.start_C.tolist(),
            "center": self.center_C.tolist(),
            "internal": self.internal,
            "rms": self.rms_mm,
        }


class TorusParams(Params):
    """What counts as a torus."""

    support_min: float = Field(0.2, gt=0, le=1, description="Least share of the segment's area on the torus.")
    filled_min: float = Field(0.35, ge=0, le=1, description="Share of the tube's area from which the surface counts as filled.")
    bend_min: float = Field(15.0, gt=0, le=360, description="Least arc, degrees; a straighter tube is a cylinder.")
    hole_min: float = Field(
        0.05, gt=0, le=10, description="Least radius of the hole, as a share of the tube's radius; without one it is a ball."
    )
    rms_max: float = Field(0.006, gt=0, le=1, description="Largest root mean square distance, as a share of the tube's radius.")


class TorusFitter:
    """Fits the torus that most of a segment follows, and the arc of it that is there."""

    key: ClassVar[str] = "torus"
    params_model: ClassVar[type[TorusParams]] = TorusParams

    def __init__(self, params: TorusParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Torus | Rejection:
        """The segment of a torus, or `no-torus` with the measured value and the limit."""
        patches = flat_patches(component.mesh, segment.faces)
        found = consensus(patches, torus_forms(patches, ctx.rng), _COSINE)
        if found is None:
            return Rejection("no-torus", "no part of the surface follows a torus")
        return self._refused(found, patches) or self._torus(found, patches)

    def _refused(self, found: Found[TorusForm], patches: FlatPatches) -> Rejection | None:
        form, size = found.form, patches.size_mm
        count, share = int(found.near.sum()), float(patches.areas[found.near].sum() / patches.areas.sum())
        if count < _LEAST:
            return Rejection("no-torus", f"{count} facets lie on the best torus, at least {_LEAST}")
        hole, least = (form.major - form.minor) / form.minor, self._params.hole_min
        if hole < least:
            return Rejection("no-torus", f"the best torus has a hole of {hole:.3f} of its tube's radius, at least {least:.3f}")
        if share < self._params.support_min:
            return Rejection(
                "no-torus",
                f"{100 * share:.1f} % of the surface lies on the best torus, at least {100 * self._params.support_min:.1f} %",
            )
        if found.rms > self._params.rms_max * form.minor:
            off, limit = found.rms * size, self._params.rms_max * form.minor * size
            return Rejection("no-torus", f"the surface deviates by {off:.3g} mm from a torus, at most {limit:.3g} mm")
        return None

    def _torus(self, found: Found[TorusForm], patches: FlatPatches) -> Torus | Rejection:
        form, chosen, size = found.form, patches.select(found.near), patches.size_mm
        begin, extent = arc(*spans(chosen, form.point, form.axis))
        if np.degrees(extent) < self._params.bend_min:
            return Rejection(
                "no-torus", f"a tube that bends by {np.degrees(extent):.1f}° is straight, at least {self._params.bend_min:.1f}°"
            )
        x = any_perpendicular(form.axis)
        filled = float(chosen.areas.sum()) / (_TURN * form.minor * form.major * extent) >= self._params.filled_min
        return Torus(
            center_C=patches.place_mm(form.point),
            axis_C=form.axis,
            start_C=np.cos(begin) * x + np.sin(begin) * np.cross(form.axis, x),
            arc_rad=extent,
            major_radius_mm=form.major * size,
            minor_radius_mm=form.minor * size,
            internal=found.sign < 0,
            rms_mm=found.rms * size,
            surface_filled=bool(filled),
        )
