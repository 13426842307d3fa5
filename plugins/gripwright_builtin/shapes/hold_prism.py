"""A regular prism is held across parallel flats by two fingers, or on every third by three."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.prism import Prism

_NO_TYPE = "no-type"


class TwoFingerPrism:
    """Select a parallel gripper across each pair of opposite flats; an odd number of sides has none."""

    key: ClassVar[str] = "two_finger_prism"
    params_model: ClassVar[type[Params]] = Params
    accepts: ClassVar[frozenset[str]] = frozenset({"prism"})

    def __init__(self, params: Params) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement for all filled pairs, the fullest first, from any direction within the flats."""
        refused = _unsuitable(fit)
        if refused is not None:
            return refused
        assert isinstance(fit, Prism)
        if fit.sides % 2:
            return Rejection(_NO_TYPE, f"of {fit.sides} even sides no two are parallel")
        emptier = fit.filled.reshape(2, -1).min(axis=0)  # (sides / 2,) of each pair
        pairs = [k for k in np.argsort(-np.round(emptier, 3), kind="stable") if emptier[k] >= fit.filled_min]
        if not pairs:
            return _empty("pair of parallel flats", float(emptier.max()), fit)
        return [
            GripRequirement(
                gripper_type=PARALLEL_2,
                opening_width_mm=fit.across_flats_mm,
                grip=EXTERNAL,
                approach_C=np.zeros((0, 3)),
                grip_axes_C=fit.sides_C[pairs],
                primitive=fit,
                rule=self.key,
            )
        ]


class ThreeFingerPrism:
    """Select a centric gripper whose fingers lie flat on three sides, 120° apart."""

    key: ClassVar[str] = "three_finger_prism"
    params_model: ClassVar[type[Params]] = Params
    accepts: ClassVar[frozenset[str]] = frozenset({"prism"})

    def __init__(self, params: Params) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement, along the axis from either end; `no-type` where no three sides stand so."""
        refused = _unsuitable(fit)
        if refused is not None:
            return refused
        assert isinstance(fit, Prism)
        if fit.sides % 3:
            return Rejection(_NO_TYPE, f"of {fit.sides} even sides no three stand 120° apart")
        emptiest = fit.filled.reshape(3, -1).min(axis=0)  # (sides / 3,) of each three
        if emptiest.max() < fit.filled_min:
            return _empty("three flats 120° apart", float(emptiest.max()), fit)
        return [
            GripRequirement(
                gripper_type=CENTRIC_3,
                opening_width_mm=fit.across_flats_mm,
                grip=EXTERNAL,
                approach_C=np.stack([-fit.axis_C, fit.axis_C]),
                grip_axes_C=np.zeros((0, 3)),
                primitive=fit,
                rule=self.key,
            )
        ]


def _unsuitable(fit: Primitive) -> Rejection | None:
    if not isinstance(fit, Prism):
        return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a prism")
    detail = f"the prism of {fit.across_flats_mm:.2f} mm across flats is a socket, held from outside only"
    return Rejection(_NO_TYPE, detail) if fit.internal else None


def _empty(what: str, share: float, fit: Prism) -> Rejection:
    return Rejection(
        _NO_TYPE, f"no {what} is filled: the best to {100 * share:.1f} %, at least {100 * fit.filled_min:.1f} % needed"
    )
