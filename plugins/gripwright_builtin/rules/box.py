"""A box is held by a two-finger parallel gripper across a pair of its filled faces (paper, section 4.1)."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Box, Primitive
from gripwright.plugin_api import Params


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
            return Rejection("no-type", f"primitive is a {fit.kind}, not a box")
        emptier = np.minimum(fit.filled[0::2], fit.filled[1::2])  # (3,) of each pair
        pairs = [k for k in range(3) if emptier[k] >= fit.filled_min]
        if not pairs:
            return Rejection(
                "no-type",
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
