"""A box is held by a parallel gripper across a pair of its filled faces (paper, section 4.1), a square one by four fingers."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_4, EXTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Box, FloatArray, Primitive
from gripwright.plugin_api import Params

_NO_TYPE = "no-type"


class TwoFingerBox:
    """Select a parallel gripper for each pair of opposite faces that are both filled.

    The pair whose emptier face is filled the most comes first; of equals the one with the smaller opening width.
    """

    key: ClassVar[str] = "two_finger_box"
    params_model: ClassVar[type[Params]] = Params
    accepts: ClassVar[frozenset[str]] = frozenset({"box"})

    def __init__(self, params: Params) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement a pair, from any direction within the faces; `no-type` where no pair is filled."""
        if not isinstance(fit, Box):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a box")
        emptier = _emptier(fit)
        pairs = [k for k in range(3) if emptier[k] >= fit.filled_min]
        if not pairs:
            return Rejection(
                _NO_TYPE,
                f"no pair of opposite box faces is filled: the best to {100 * emptier.max():.1f} %, "
                f"at least {100 * fit.filled_min:.1f} % needed",
            )
        pairs.sort(key=lambda k: (-round(float(emptier[k]), 3), float(fit.extents_mm[k])))
        return [
            GripRequirement(
                gripper_type=PARALLEL_2,
                opening_width_mm=float(fit.extents_mm[k]),
                grip=EXTERNAL,
                approach_C=np.zeros((0, 3)),
                grip_axes_C=fit.X_CB[None, :3, k],
                primitive=fit,
                rule=self.key,
            )
            for k in pairs
        ]


class FourFingerBoxSettings(Params):
    """How square a box has to be."""

    difference_max: float = Field(
        0.08, ge=0, le=0.1, description="mm between the widths of the two pairs of faces; more than 0.09 leaves two fingers off"
    )


class FourFingerBox:
    """Select a centric gripper of four fingers for a box of square section whose four sides are filled.

    Of several square sections the one whose emptiest side is filled the most comes first.
    """

    key: ClassVar[str] = "four_finger_box"
    params_model: ClassVar[type[Params]] = FourFingerBoxSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"box"})

    def __init__(self, params: FourFingerBoxSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement a square section, along its axis from either end; `no-type` where four filled sides are not square."""
        if not isinstance(fit, Box):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a box")
        emptier = _emptier(fit)
        sides = {k: [(k + 1) % 3, (k + 2) % 3] for k in range(3)}  # across each axis
        filled = [k for k in range(3) if emptier[sides[k]].min() >= fit.filled_min]
        if not filled:
            best = max(float(emptier[sides[k]].min()) for k in range(3))
            return Rejection(
                _NO_TYPE,
                f"no four box faces around an axis are filled: the best to {100 * best:.1f} %, "
                f"at least {100 * fit.filled_min:.1f} % needed",
            )
        uneven = {k: float(np.ptp(fit.extents_mm[sides[k]])) for k in filled}
        square = [k for k in filled if uneven[k] <= self._params.difference_max]
        if not square:
            return Rejection(
                _NO_TYPE,
                f"no section of the box is square: its sides differ by {min(uneven.values()):.3f} mm, "
                f"at most {self._params.difference_max:g} mm",
            )
        square.sort(key=lambda k: -round(float(emptier[sides[k]].min()), 3))
        return [
            GripRequirement(
                gripper_type=CENTRIC_4,
                opening_width_mm=float(fit.extents_mm[sides[k]].mean()),
                grip=EXTERNAL,
                approach_C=np.stack([-fit.X_CB[:3, k], fit.X_CB[:3, k]]),
                grip_axes_C=np.zeros((0, 3)),
                primitive=fit,
                rule=self.key,
            )
            for k in square
        ]


def _emptier(fit: Box) -> FloatArray:
    """Of each pair of opposite faces how far the emptier one is filled, (3,)."""
    return np.minimum(fit.filled[0::2], fit.filled[1::2])
