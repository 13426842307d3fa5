"""A cone or a pyramid is held by tapered tips, whose gripping surfaces lie along its flanks."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import FloatArray, Primitive
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.pyramid import Pyramid

_NO_TYPE = "no-type"


class TaperSettings(Params):
    """Which tapers tips are made with."""

    taper_step: float = Field(
        0.5, gt=0, le=1, description="degrees; half angles are rounded to it: what rounds alike may share a gripper"
    )
    half_angle_max: float = Field(
        30.0, gt=0, lt=45, description="degrees; steeper flanks slip out of tips at any friction of rubber on metal"
    )


class ThreeFingerCone:
    """Select a centric gripper with tips tapered like the cone, from its narrow end or from its wide one.

    From the narrow end the tips come nearer to each other towards the palm, from the wide end towards their own ends. Either way
    the flanks are pressed out along the axis: friction has to exceed the tangent of the half angle, which is the host's to judge.
    """

    key: ClassVar[str] = "three_finger_cone"
    params_model: ClassVar[type[Params]] = TaperSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"cone"})
    gripper_type: ClassVar[str] = CENTRIC_3

    def __init__(self, params: TaperSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement an end; `no-type` for a conical bore and for a cone that is too steep."""
        if not isinstance(fit, Cone):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a cone")
        if fit.internal:
            return Rejection(_NO_TYPE, "the cone is a bore, tapered tips hold from outside")
        mean_mm = fit.radius_mm + fit.radius_top_mm
        return _requirements(fit, self.gripper_type, mean_mm, np.zeros((0, 3)), self._params, self.key)


class FourFingerCone(ThreeFingerCone):
    """The same for a centric gripper of four fingers."""

    key: ClassVar[str] = "four_finger_cone"
    gripper_type: ClassVar[str] = CENTRIC_4


class TwoFingerPyramid:
    """Select a parallel gripper with tips tapered like the pyramid, across each pair of opposite sides that are filled."""

    key: ClassVar[str] = "two_finger_pyramid"
    params_model: ClassVar[type[Params]] = TaperSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"pyramid"})

    def __init__(self, params: TaperSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement an end, across all such pairs; `no-type` where there are none, and for one that is too steep."""
        refused = _unsuitable(fit)
        if refused is not None:
            return refused
        assert isinstance(fit, Pyramid)
        if fit.sides % 2:
            return Rejection(_NO_TYPE, f"a pyramid of {fit.sides} sides has no opposite ones")
        half = fit.sides // 2
        emptier = np.minimum(fit.filled[:half], fit.filled[half:])  # of each pair
        pairs = np.flatnonzero(emptier >= fit.filled_min)
        if not len(pairs):
            return Rejection(
                _NO_TYPE,
                f"no pair of opposite sides of the pyramid is filled: the best to {100 * emptier.max():.1f} %, "
                f"at least {100 * fit.filled_min:.1f} % needed",
            )
        return _requirements(fit, PARALLEL_2, _mean_mm(fit), fit.sides_C[pairs], self._params, self.key)


class ThreeFingerPyramid:
    """Select a centric gripper of three fingers with tips tapered like a pyramid of 3 or 6 sides, on every one or every other."""

    key: ClassVar[str] = "three_finger_pyramid"
    params_model: ClassVar[type[Params]] = TaperSettings
    accepts: ClassVar[frozenset[str]] = frozenset({"pyramid"})
    fingers: ClassVar[int] = 3
    gripper_type: ClassVar[str] = CENTRIC_3

    def __init__(self, params: TaperSettings) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement an end; `no-type` where no filled side stands at each finger, or where it is too steep."""
        refused = _unsuitable(fit)
        if refused is not None:
            return refused
        assert isinstance(fit, Pyramid)
        if fit.sides % self.fingers:
            return Rejection(_NO_TYPE, f"a pyramid of {fit.sides} sides has not one every {360 // self.fingers}°")
        emptiest = fit.filled.reshape(self.fingers, -1).min(axis=0)  # of the sides that fingers stand on, by the first of them
        if emptiest.max() < fit.filled_min:
            return Rejection(
                _NO_TYPE,
                f"one of {self.fingers} sides of the pyramid is filled to {100 * emptiest.max():.1f} %, "
                f"at least {100 * fit.filled_min:.1f} % needed",
            )
        return _requirements(fit, self.gripper_type, _mean_mm(fit), np.zeros((0, 3)), self._params, self.key)


class FourFingerPyramid(ThreeFingerPyramid):
    """The same for four fingers on a pyramid of 4 or 8 sides."""

    key: ClassVar[str] = "four_finger_pyramid"
    fingers: ClassVar[int] = 4
    gripper_type: ClassVar[str] = CENTRIC_4


def _unsuitable(fit: Primitive) -> Rejection | None:
    if not isinstance(fit, Pyramid):
        return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a pyramid")
    return Rejection(_NO_TYPE, "the pyramid is a hollow, tapered tips hold from outside") if fit.internal else None


def _mean_mm(fit: Pyramid) -> float:
    return (fit.across_flats_mm + fit.across_flats_top_mm) / 2.0


def _requirements(
    fit: Cone | Pyramid, gripper_type: str, mean_mm: float, grip_axes_C: FloatArray, settings: TaperSettings, rule: str
) -> list[GripRequirement] | Rejection:
    """From the narrow end, then from the wide one, at the width half way up."""
    half_angle = float(np.degrees(fit.half_angle_rad))
    if half_angle > settings.half_angle_max:
        return Rejection(
            _NO_TYPE,
            f"the half angle of the {fit.kind} is {half_angle:.1f}°, tapered tips hold up to {settings.half_angle_max:.1f}°",
        )
    taper = max(round(half_angle / settings.taper_step), 1) * settings.taper_step
    return [
        GripRequirement(
            gripper_type=gripper_type,
            opening_width_mm=mean_mm,
            grip=EXTERNAL,
            approach_C=sign * fit.axis_C[None],
            grip_axes_C=grip_axes_C,
            primitive=fit,
            rule=rule,
            taper_rad=float(np.radians(sign * taper)),
        )
        for sign in (-1.0, 1.0)
    ]
