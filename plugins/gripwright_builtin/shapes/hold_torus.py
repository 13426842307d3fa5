"""A torus is held across its tube by two fingers, or about its equators by three where the tube is thick enough."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, INTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.belt import belt, touched_mm
from gripwright_builtin.shapes.torus import Torus

_NO_TYPE = "no-type"
_THREE_RAD = 4.0 * np.pi / 3.0  # the arc from the first to the last of three fingers


class TorusHoldParams(Params):
    """Parameters of the rules."""

    contact_min: float = Field(3.0, gt=0, le=100, description="mm, least length along which a straight finger touches the torus.")


class TwoFingerTorus:
    """Select a parallel gripper across the tube, along the axis: flat fingers touch the ring along a chord."""

    key: ClassVar[str] = "two_finger_torus"
    params_model: ClassVar[type[TorusHoldParams]] = TorusHoldParams
    accepts: ClassVar[frozenset[str]] = frozenset({"torus"})

    def __init__(self, params: TorusHoldParams) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement at the tube's diameter; `no-type` where the chord is too short."""
        if not isinstance(fit, Torus):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a torus")
        if fit.internal:
            return Rejection(_NO_TYPE, f"the torus of tube radius {fit.minor_radius_mm:.2f} mm is the inside of a tube")
        strip_mm = touched_mm(fit.minor_radius_mm)
        chord_mm = min(2.0 * np.sqrt(2.0 * fit.major_radius_mm * strip_mm), fit.major_radius_mm * fit.arc_rad)
        if chord_mm < self._params.contact_min:
            return Rejection(
                _NO_TYPE, f"flat fingers touch the tube {chord_mm:.2f} mm along, at least {self._params.contact_min:.2f} mm"
            )
        tangent = np.cross(fit.axis_C, fit.start_C)
        return [
            GripRequirement(
                gripper_type=PARALLEL_2,
                opening_width_mm=2.0 * fit.minor_radius_mm,
                grip=EXTERNAL,
                approach_C=np.zeros((0, 3)),
                grip_axes_C=fit.axis_C[None].copy(),
                primitive=belt(fit.center_C, tangent, fit.minor_radius_mm, float(chord_mm), internal=False, rms_mm=fit.rms_mm),
                rule=self.key,
            )
        ]


class ThreeFingerTorus:
    """Select a centric gripper on the outer equator, or from inside on the one of the hole."""

    key: ClassVar[str] = "three_finger_torus"
    params_model: ClassVar[type[TorusHoldParams]] = TorusHoldParams
    accepts: ClassVar[frozenset[str]] = frozenset({"torus"})

    def __init__(self, params: TorusHoldParams) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """From outside, then from inside; `no-type` for a thin tube or a short arc."""
        if not isinstance(fit, Torus):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a torus")
        if fit.internal:
            return Rejection(_NO_TYPE, f"the torus of tube radius {fit.minor_radius_mm:.2f} mm is the inside of a tube")
        if fit.arc_rad <= _THREE_RAD:
            arc, least = np.degrees(fit.arc_rad), np.degrees(_THREE_RAD)
            return Rejection(_NO_TYPE, f"the torus goes round by {arc:.1f}°, three fingers need more than {least:.0f}°")
        height = touched_mm(fit.minor_radius_mm)
        if height < self._params.contact_min:
            return Rejection(
                _NO_TYPE,
                f"straight fingers touch the torus's equator {height:.2f} mm high, at least {self._params.contact_min:.2f} mm",
            )
        outer, inner = fit.major_radius_mm + fit.minor_radius_mm, fit.major_radius_mm - fit.minor_radius_mm
        return [self._at(fit, outer, height, EXTERNAL), self._at(fit, inner, height, INTERNAL)]

    def _at(self, fit: Torus, radius_mm: float, height_mm: float, grip: str) -> GripRequirement:
        return GripRequirement(
            gripper_type=CENTRIC_3,
            opening_width_mm=2.0 * radius_mm,
            grip=grip,
            approach_C=np.stack([-fit.axis_C, fit.axis_C]),
            grip_axes_C=np.zeros((0, 3)),
            primitive=belt(fit.center_C, fit.axis_C, radius_mm, height_mm, internal=grip == INTERNAL, rms_mm=fit.rms_mm),
            rule=self.key,
        )
