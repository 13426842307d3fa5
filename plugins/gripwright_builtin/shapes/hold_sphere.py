"""A large sphere is held about its equator, like the low cylinder that touches it there."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, GripRequirement
from gripwright.domain.shape import FloatArray, Primitive
from gripwright.geometry.frames import any_perpendicular
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.belt import belt, touched_mm
from gripwright_builtin.shapes.sphere import Sphere

_NO_TYPE = "no-type"
_CUT_MIN = 0.6  # of the radius: a cut so far from the centre leaves room for three fingers about another axis


class SphereHoldParams(Params):
    """Parameters of the rule."""

    contact_min: float = Field(
        3.0, gt=0, le=100, description="mm, least height along which a straight finger touches the sphere."
    )


class ThreeFingerSphere:
    """Select a centric gripper that closes on the equator of a sphere; small ones are touched along too short an arc."""

    key: ClassVar[str] = "three_finger_sphere"
    params_model: ClassVar[type[SphereHoldParams]] = SphereHoldParams
    accepts: ClassVar[frozenset[str]] = frozenset({"sphere"})

    def __init__(self, params: SphereHoldParams) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement about the zone's axis and, of a nearly whole sphere, about two across it; `no-type` with the limit."""
        if not isinstance(fit, Sphere):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a sphere")
        if fit.internal:
            return Rejection(_NO_TYPE, f"the sphere of radius {fit.radius_mm:.2f} mm is a hollow")
        reach = touched_mm(fit.radius_mm) / 2.0
        low, high = max(fit.low_mm, -reach), min(fit.high_mm, reach)
        if high - low < self._params.contact_min:
            return Rejection(
                _NO_TYPE,
                f"straight fingers touch the sphere's equator {max(high - low, 0.0):.2f} mm high, "
                f"at least {self._params.contact_min:.2f} mm",
            )
        found = [self._about(fit, fit.axis_C, low, high)]
        if max(fit.high_mm, -fit.low_mm) >= fit.radius_mm and min(fit.high_mm, -fit.low_mm) >= _CUT_MIN * fit.radius_mm:
            across = any_perpendicular(fit.axis_C)
            found += [self._about(fit, axis, -reach, reach) for axis in (across, np.cross(fit.axis_C, across))]
        return found

    def _about(self, fit: Sphere, axis_C: FloatArray, low_mm: float, high_mm: float) -> GripRequirement:
        middle = fit.center_C + axis_C * (low_mm + high_mm) / 2.0
        return GripRequirement(
            gripper_type=CENTRIC_3,
            opening_width_mm=2.0 * fit.radius_mm,
            grip=EXTERNAL,
            approach_C=np.stack([-axis_C, axis_C]),
            grip_axes_C=np.zeros((0, 3)),
            primitive=belt(middle, axis_C, fit.radius_mm, high_mm - low_mm, internal=False, rms_mm=fit.rms_mm),
            rule=self.key,
        )
