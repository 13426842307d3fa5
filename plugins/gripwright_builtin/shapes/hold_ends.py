"""What has two parallel end faces is held across them: a frustum, a prism, a profile."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.extrusion import Extrusion
from gripwright_builtin.shapes.prism import Prism
from gripwright_builtin.shapes.pyramid import Pyramid

_NO_TYPE = "no-type"


class EndsParams(Params):
    """Parameters of the rule."""

    filled_min: float = Field(0.1, gt=0, le=1, description="Share of an end face's area from which it counts as filled.")


class TwoFingerEnds:
    """Select a parallel gripper across both end faces, as far open as the primitive is high."""

    key: ClassVar[str] = "two_finger_ends"
    params_model: ClassVar[type[EndsParams]] = EndsParams
    accepts: ClassVar[frozenset[str]] = frozenset({"cone", "pyramid", "prism", "extrusion"})

    def __init__(self, params: EndsParams) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement, from any direction within the end faces; `no-type` where one is not there."""
        if not isinstance(fit, Cone | Pyramid | Prism | Extrusion):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, without end faces")
        if fit.internal:
            return Rejection(_NO_TYPE, f"the {fit.kind} is a hollow, which has no end faces")
        emptier = float(fit.ends_filled.min())
        if emptier < self._params.filled_min:
            share, least = 100 * emptier, 100 * self._params.filled_min
            return Rejection(_NO_TYPE, f"an end face of the {fit.kind} is filled to {share:.1f} %, at least {least:.1f} %")
        return [
            GripRequirement(
                gripper_type=PARALLEL_2,
                opening_width_mm=fit.height_mm,
                grip=EXTERNAL,
                approach_C=np.zeros((0, 3)),
                grip_axes_C=fit.axis_C[None].copy(),
                primitive=fit,
                rule=self.key,
            )
        ]
