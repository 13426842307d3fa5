"""Straight fingers on what tapers hardly at all: a slender cone, a slender pyramid. A steeper one needs tapered tips."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, INTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.belt import GAP_MM, belt
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.pyramid import Pyramid

_NO_TYPE = "no-type"
_BAND_MM = 0.8  # by which the radius differs within one requirement: the host seats fingers within 0.5 mm of the opening


class StraightParams(Params):
    """Parameters of the rules."""

    contact_min: float = Field(3.0, gt=0, le=100, description="mm, least height along which a straight finger touches the taper.")


class StraightCone:
    """Select a centric gripper for a cone so slender that straight fingers touch it."""

    key: ClassVar[str] = "straight_cone"
    params_model: ClassVar[type[StraightParams]] = StraightParams
    accepts: ClassVar[frozenset[str]] = frozenset({"cone"})

    def __init__(self, params: StraightParams) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """One requirement for each band of the cone, the middle one first; `no-type` where it tapers too much."""
        if not isinstance(fit, Cone):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a cone")
        steep = _too_steep(fit.half_angle_rad, self._params.contact_min, "cone")
        if steep is not None:
            return steep
        count = max(1, int(np.ceil((fit.radius_mm - fit.radius_top_mm) / _BAND_MM)))
        height = fit.height_mm / count
        bands = sorted((k + 0.5) * height - fit.height_mm / 2.0 for k in range(count))
        bands.sort(key=abs)
        mean, slope = (fit.radius_mm + fit.radius_top_mm) / 2.0, float(np.tan(fit.half_angle_rad))
        return [self._band(fit, at, mean - slope * at, height) for at in bands]

    def _band(self, fit: Cone, at_mm: float, radius_mm: float, height_mm: float) -> GripRequirement:
        center = fit.center_C + fit.axis_C * at_mm
        return GripRequirement(
            gripper_type=CENTRIC_3,
            opening_width_mm=2.0 * radius_mm,
            grip=INTERNAL if fit.internal else EXTERNAL,
            approach_C=np.stack([-fit.axis_C, fit.axis_C]),
            grip_axes_C=np.zeros((0, 3)),
            primitive=belt(center, fit.axis_C, radius_mm, height_mm, internal=fit.internal, rms_mm=fit.rms_mm),
            rule=self.key,
        )


class StraightPyramid:
    """Select a gripper for a pyramid so slender that straight fingers lie flat on its sides."""

    key: ClassVar[str] = "straight_pyramid"
    params_model: ClassVar[type[StraightParams]] = StraightParams
    accepts: ClassVar[frozenset[str]] = frozenset({"pyramid"})

    def __init__(self, params: StraightParams) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """Two fingers across opposite sides, three on every third; `no-type` where it tapers too much or has no such sides."""
        if not isinstance(fit, Pyramid):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not a pyramid")
        if fit.internal:
            return Rejection(_NO_TYPE, f"the pyramid of {fit.across_flats_mm:.2f} mm across flats is a hollow")
        steep = _too_steep(fit.half_angle_rad, self._params.contact_min, "pyramid")
        if steep is not None:
            return steep
        two, three = fit.sides % 2 == 0, fit.sides % 3 == 0
        if not (two or three):
            return Rejection(_NO_TYPE, f"of {fit.sides} even sides neither two face each other nor three stand 120° apart")
        return [
            GripRequirement(
                gripper_type=PARALLEL_2 if two else CENTRIC_3,
                opening_width_mm=(fit.across_flats_mm + fit.across_flats_top_mm) / 2.0,
                grip=EXTERNAL,
                approach_C=np.zeros((0, 3)) if two else np.stack([-fit.axis_C, fit.axis_C]),
                grip_axes_C=fit.sides_C[: fit.sides // 2] if two else np.zeros((0, 3)),
                primitive=fit,
                rule=self.key,
            )
        ]


def _too_steep(half_angle_rad: float, contact_mm: float, what: str) -> Rejection | None:
    limit = float(np.degrees(np.arctan2(GAP_MM, contact_mm)))
    angle = float(np.degrees(half_angle_rad))
    if angle <= limit:
        return None
    return Rejection(_NO_TYPE, f"the {what} has a half angle of {angle:.2f}°, straight fingers touch up to {limit:.2f}°")
