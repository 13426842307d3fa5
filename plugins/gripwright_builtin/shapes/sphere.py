"""Spheres and zones of spheres: the primitive and its fitter."""

from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import BoolArray, FloatArray, Mesh, Segment
from gripwright.geometry.drawn import revolved
from gripwright.geometry.frames import pose_along
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.shapes.consensus import Found, consensus
from gripwright_builtin.shapes.patches import FlatPatches, flat_patches

_COSINE = float(np.cos(np.radians(24.0)))  # half the diagonal of a facet
_DRAWS = 120
_RADII = (1e-3, 2.0)  # shares of the size; the zone of a larger one is flat
_WHOLE = 0.97  # of the radius: a zone that ends nearer to a pole than the rest has that pole
_ONE_SIDED, _UNEVEN = 0.05, 0.03  # of what faces one way, and of what faces along a line, on a zone that has an axis
_LEAST = 8  # patches


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sphere:
    """A sphere, or the zone of one that two planes across `axis_C` cut out: a cap, a ball with a neck, a dome."""

    center_C: FloatArray  # (3,) of the sphere
    radius_mm: float
    axis_C: FloatArray  # (3,) unit, of the zone; of a whole sphere any
    low_mm: float  # where the zone begins along the axis, from the centre, −radius..radius
    high_mm: float  # where it ends
    internal: bool  # True: a hollow
    rms_mm: float
    surface_filled: bool
    kind: str = field(default="sphere", init=False)

    @property
    def volume_mm3(self) -> float:
        """π (r² (b − a) − (b³ − a³) / 3), of a whole sphere 4/3 π r³."""
        a, b = self.low_mm, self.high_mm
        return float(np.pi * (self.radius_mm**2 * (b - a) - (b**3 - a**3) / 3.0))

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`; chords of `angle_rad` lie deeper, and a hollow has no end faces."""
        v = points_mm - self.center_C
        distance, along = np.linalg.norm(v, axis=1), v @ self.axis_C
        depth, sign = self.radius_mm - distance, -1.0 if self.internal else 1.0
        turned = (normals * v).sum(axis=1) * sign >= np.cos(angle_rad) * distance
        chord_mm = self.radius_mm * (1.0 - np.cos(angle_rad))
        within = (along >= self.low_mm - tolerance_mm) & (along <= self.high_mm + tolerance_mm)
        round_ = turned & (depth >= -tolerance_mm) & (depth <= tolerance_mm + chord_mm) & within
        upper = np.abs(along - self.high_mm) < np.abs(along - self.low_mm)
        end = np.abs(along - np.where(upper, self.high_mm, self.low_mm)) <= tolerance_mm
        end &= (depth >= -tolerance_mm) & (normals @ self.axis_C * np.where(upper, 1.0, -1.0) >= np.cos(angle_rad))
        return np.asarray(round_ if self.internal else round_ | end)

    def drawn(self) -> Mesh:
        """See `DrawnPrimitive`."""
        turns = np.linspace(np.arcsin(self.low_mm / self.radius_mm), np.arcsin(self.high_mm / self.radius_mm), 49)
        curve = self.radius_mm * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        ends = [
            [[0.0, end]]
            for end, radius in ((self.low_mm, curve[0, 0]), (self.high_mm, curve[-1, 0]))
            if radius > 1e-9 * self.radius_mm
        ]
        return revolved(np.concatenate([curve, *ends[::-1]]), pose_along(self.axis_C, self.center_C))

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm."""
        return {
            "radius": self.radius_mm,
            "center": self.center_C.tolist(),
            "axis": self.axis_C.tolist(),
            "low": self.low_mm,
            "high": self.high_mm,
            "internal": self.internal,
            "rms": self.rms_mm,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Form:
    """A whole sphere."""

    center: FloatArray  # (3,)
    radius: float

    @property
    def free(self) -> int:
        return 4

    def distances(self, points: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(points - self.center, axis=1) - self.radius)

    def cosines(self, points: FloatArray, facing: FloatArray) -> FloatArray:
        v = points - self.center
        return np.asarray((v * facing).sum(axis=1) / np.maximum(np.linalg.norm(v, axis=1), 1e-12))

    def moved(self, step: FloatArray) -> Self:
        return type(self)(center=self.center + step[:3], radius=self.radius + float(step[3]))


class SphereParams(Params):
    """What counts as a sphere."""

    support_min: float = Field(0.2, gt=0, le=1, description="Least share of the segment's area on the sphere.")
    filled_min: float = Field(0.5, ge=0, le=1, description="Share of the zone's area from which the surface counts as filled.")
    zone_min: float = Field(0.1, gt=0, le=2, description="Least height of the zone, as a share of the radius.")
    rms_max: float = Field(0.006, gt=0, le=1, description="Largest root mean square distance, as a share of the radius.")


class SphereFitter:
    """Fits the sphere that most of a segment follows, and the zone of it that is there."""

    key: ClassVar[str] = "sphere"
    params_model: ClassVar[type[SphereParams]] = SphereParams

    def __init__(self, params: SphereParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Sphere | Rejection:
        """The zone of a sphere, or `no-sphere` with the measured value and the limit."""
        patches = flat_patches(component.mesh, segment.faces)
        found = consensus(patches, _proposals(patches, ctx.rng), _COSINE)
        if found is None or found.form.radius > _RADII[1]:
            return Rejection("no-sphere", "no part of the surface follows a sphere")
        count, share = int(found.near.sum()), float(patches.areas[found.near].sum() / patches.areas.sum())
        if count < _LEAST:
            return Rejection("no-sphere", f"{count} facets lie on the best sphere, at least {_LEAST}")
        if share < self._params.support_min:
            return Rejection(
                "no-sphere",
                f"{100 * share:.1f} % of the surface lies on the best sphere, at least {100 * self._params.support_min:.1f} %",
            )
        radius = found.form.radius
        if found.rms > self._params.rms_max * radius:
            off, limit = found.rms * patches.size_mm, self._params.rms_max * radius * patches.size_mm
            return Rejection("no-sphere", f"the surface deviates by {off:.3g} mm from a sphere, at most {limit:.3g} mm")
        return self._zone(found, patches)

    def _zone(self, found: Found[_Form], patches: FlatPatches) -> Sphere | Rejection:
        form, chosen = found.form, patches.select(found.near)
        axis = _axis(chosen)
        along = (chosen.points - form.center) @ axis
        low, high = float(along.min()), float(along.max())
        low = -form.radius if low < -_WHOLE * form.radius else low
        high = form.radius if high > _WHOLE * form.radius else high
        if high - low < self._params.zone_min * form.radius:
            share, least = (high - low) / form.radius, self._params.zone_min
            return Rejection("no-sphere", f"the zone is {share:.3f} radii high, at least {least:.3f}")
        filled = float(chosen.areas.sum()) / (2.0 * np.pi * form.radius * (high - low))
        return Sphere(
            center_C=patches.place_mm(form.center),
            radius_mm=form.radius * patches.size_mm,
            axis_C=axis,
            low_mm=low * patches.size_mm,
            high_mm=high * patches.size_mm,
            internal=found.sign < 0,
            rms_mm=found.rms * patches.size_mm,
            surface_filled=bool(filled >= self._params.filled_min),
        )


def _proposals(patches: FlatPatches, rng: np.random.Generator) -> list[_Form]:
    """Spheres that two patches each touch with their middles, as they face."""
    if len(patches.areas) < 2:
        return []
    drawn = patches.drawn(rng, _DRAWS, 2)
    n, c = patches.normals[drawn], patches.centres[drawn]  # (d, 2, 3)
    turn, step = n[:, 0] - n[:, 1], c[:, 0] - c[:, 1]
    square = (turn**2).sum(axis=1)
    radius = np.divide((step * turn).sum(axis=1), square, out=np.zeros(len(c)), where=square > 1e-4)
    center = (c - radius[:, None, None] * n).mean(axis=1)
    good = (np.abs(radius) > _RADII[0]) & (np.abs(radius) < _RADII[1])
    return [_Form(center=center[k], radius=float(abs(radius[k]))) for k in np.flatnonzero(good)]


def _axis(patches: FlatPatches) -> FloatArray:
    """The axis of a zone: where its normals point on the whole or, of one cut alike at both ends, along which they are rarest."""
    share = patches.areas / patches.areas.sum()
    mean = share @ patches.normals
    if np.linalg.norm(mean) > _ONE_SIDED:
        return np.asarray(mean / np.linalg.norm(mean))
    values, vectors = np.linalg.eigh((patches.normals * share[:, None]).T @ patches.normals)
    if values[1] - values[0] > _UNEVEN:
        return np.asarray(vectors[:, 0])
    return np.array([0.0, 0.0, 1.0])
