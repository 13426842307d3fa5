"""A cylinder is held by a centric gripper: from outside, or a bore from inside (paper, section 4.1)."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL, INTERNAL, GripRequirement
from gripwright.domain.shape import Cylinder, Primitive
from gripwright.plugin_api import Params

_NO_TYPE = "no-type"


class ThreeFingerCylinder:
    """Select a centric gripper whose opening equals the fitted diameter.

    Three contacts hold a cylinder against torque about any radial axis, whatever its radius; two do not.
    """

    gripper_type: ClassVar[str] = CENTRIC_3
    key: ClassVar[str] = "three_finger_cylinder"
    params_model: ClassVar[type[Params]] = Params
    accepts: ClassVar[frozenset[str]] = frozenset({"cylinder"})

    def __init__(self, params: Params) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement, along the axis from either end; `no-type` for a bore."""
        if not isinstance(fit, Cylinder):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a cylinder")
        if fit.internal:
            return Rejection(_NO_TYPE, f"the cylinder of diameter {2.0 * fit.radius_mm:.2f} mm is a bore, held from inside only")
        return [_requirement(fit, self.gripper_type, EXTERNAL, self.key)]


class FourFingerCylinder(ThreeFingerCylinder):
    """Select a centric gripper of four fingers whose opening equals the fitted diameter: it divides the force on thin walls."""

    gripper_type: ClassVar[str] = CENTRIC_4
    key: ClassVar[str] = "four_finger_cylinder"


class ThreeFingerBore:
    """Select a centric gripper that spreads its fingers inside a bore of the fitted diameter.

    Of a segment with an outer surface and a bore, as a ring is, the bore counts.
    """

    key: ClassVar[str] = "three_finger_bore"
    params_model: ClassVar[type[Params]] = Params
    accepts: ClassVar[frozenset[str]] = frozenset({"cylinder"})

    def __init__(self, params: Params) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement, along the axis from either end; `no-type` for an outer surface."""
        if not isinstance(fit, Cylinder):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a cylinder")
        bore = fit if fit.internal else fit.bore
        if bore is None:
            return Rejection(_NO_TYPE, f"the cylinder of diameter {2.0 * fit.radius_mm:.2f} mm is an outer surface, not a bore")
        return [_requirement(bore, CENTRIC_3, INTERNAL, self.key)]


def _requirement(fit: Cylinder, gripper_type: str, grip: str, rule: str) -> GripRequirement:
    return GripRequirement(
        gripper_type=gripper_type,
        opening_width_mm=2.0 * fit.radius_mm,
        grip=grip,
        approach_C=np.stack([-fit.axis_C, fit.axis_C]),
        grip_axes_C=np.zeros((0, 3)),
        primitive=fit,
        rule=rule,
    )
