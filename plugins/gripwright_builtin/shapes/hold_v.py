"""A cylinder or a cone is held along its axis by two fingers whose tips have a V."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Cylinder, FloatArray, Primitive
from gripwright.domain.v_tip import Vee
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.hold_tapered import TaperSettings, taper_degrees

_NO_TYPE = "no-type"
_ROOM_MM = 0.5  # aside of where it touches, on the V


class VSettings(Params):
    """Which V tips are made with: what is held with the same may share a gripper."""

    v_angle: float = Field(120.0, ge=60, le=170, description="degrees between the flanks; a flatter V holds larger radii")
    v_depth: float = Field(
        3.0, gt=0, le=50, description="mm; the tip is as wide as its V. Wider than about 10.5 mm it may cover the bolts of a jaw"
    )

    @property
    def vee(self) -> Vee:
        """The V."""
        return Vee(angle_rad=float(np.radians(self.v_angle)), depth_mm=self.v_depth)

    @property
    def radii_mm(self) -> tuple[float, float]:
        """What the V holds: it touches the flanks and not their ends, and the tips do not meet before."""
        vee = self.vee
        across, aside = np.cos(vee.turn_rad), np.sin(vee.turn_rad)
        least = max(_ROOM_MM / aside, (vee.depth_mm + _ROOM_MM) * across)
        return float(least), float((vee.width_mm / 2.0 - _ROOM_MM) / aside)


class ConeVSettings(VSettings, TaperSettings):
    """Which V tips are made with, and which tapers."""


class TwoFingerCylinder:
    """Select a parallel gripper with V tips for a cylinder, along its axis from either end.

    Each finger touches along two lines: the four of them hold torque about any axis, and centre the cylinder between them.
    """

    key: ClassVar[str] = "two_finger_cylinder"
    params_model: ClassVar[type[Params]] = VSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"cylinder"})

    def __init__(self, params: VSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement, along the axis from either end; `no-type` for a bore, and where the V is too small or too large."""
        if not isinstance(fit, Cylinder):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a cylinder")
        if fit.internal:
            return Rejection(_NO_TYPE, "the cylinder is a bore, V tips hold from outside")
        refused = _not_in_v(fit.kind, fit.radius_mm, fit.radius_mm, self._params)
        if refused is not None:
            return refused
        ends = np.stack([-fit.axis_C, fit.axis_C])
        return [_requirement(fit, fit.radius_mm, ends, 0.0, self._params.vee, self.key)]


class TwoFingerCone:
    """Select a parallel gripper with V tips tapered like a cone, from its narrow end or from its wide one.

    As of other tapered tips, friction has to exceed the tangent of the half angle, whichever end is held.
    """

    key: ClassVar[str] = "two_finger_cone"
    params_model: ClassVar[type[Params]] = ConeVSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"cone"})

    def __init__(self, params: ConeVSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement an end; `no-type` for a conical bore, for a cone that is too steep, and where the V does not suit it."""
        if not isinstance(fit, Cone):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a cone")
        if fit.internal:
            return Rejection(_NO_TYPE, "the cone is a bore, V tips hold from outside")
        taper = taper_degrees(fit, self._params)
        if isinstance(taper, Rejection):
            return taper
        refused = _not_in_v(fit.kind, fit.radius_top_mm, fit.radius_mm, self._params)
        if refused is not None:
            return refused
        radius = float(np.clip((fit.radius_mm + fit.radius_top_mm) / 2.0, *self._params.radii_mm))
        return [
            _requirement(fit, radius, sign * fit.axis_C[None], float(np.radians(sign * taper)), self._params.vee, self.key)
            for sign in (-1.0, 1.0)
        ]


def _not_in_v(kind: str, narrow_mm: float, wide_mm: float, settings: VSettings) -> Rejection | None:
    least, most = settings.radii_mm
    if narrow_mm <= most and wide_mm >= least:
        return None
    radius = narrow_mm if narrow_mm > most else wide_mm
    return Rejection(
        _NO_TYPE,
        f"the {kind} has a radius of {radius:.2f} mm, a V of {settings.v_angle:g}° and {settings.v_depth:g} mm holds "
        f"{least:.2f} to {most:.2f} mm",
    )


def _requirement(
    fit: Cylinder | Cone, radius_mm: float, approach_C: FloatArray, taper_rad: float, vee: Vee, rule: str
) -> GripRequirement:
    return GripRequirement(
        gripper_type=PARALLEL_2,
        opening_width_mm=vee.opening_mm(radius_mm),
        grip=EXTERNAL,
        approach_C=approach_C,
        grip_axes_C=np.zeros((0, 3)),
        primitive=fit,
        rule=rule,
        taper_rad=taper_rad,
        vee=vee,
    )
