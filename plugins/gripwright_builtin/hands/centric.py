"""The hands of centric grippers: three or four flat fingers around a component, a cylinder's slices within a bore."""

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL
from gripwright.domain.gripper import ConvexSolid
from gripwright.plugin_api.params import Params
from gripwright_builtin.hands.prism import HandSettings, PrismHand

_NOSE_STEP = 4.0  # degrees at the most between the flats that stand for the rounded nose


class CentricSettings(HandSettings):
    """Sections of the straight finger: flat for an external grip, rounded for a bore."""

    nose_radius_mm: float = Field(
        4.0, gt=0, le=100, description="mm, of the rounded gripping surface for bores; the fingers close to twice as much"
    )
    nose_thickness_mm: float = Field(3.6, gt=0, le=100, description="mm, extent of a finger for bores towards the axis")

    @model_validator(mode="after")
    def _within_the_slice(self) -> "CentricSettings":
        if self.nose_thickness_mm >= self.nose_radius_mm:
            raise ValueError(
                f"nose_thickness_mm {self.nose_thickness_mm:g} is not less than nose_radius_mm {self.nose_radius_mm:g}"
            )
        return self


class CentricHand(PrismHand):
    """Three straight fingers at 0°, 120° and 240° that move radially together.

    A finger for bores is a third (of four fingers a quarter) of a cylinder without the core: its round side, the nose, touches
    a bore of any larger radius along the line in its middle.
    """

    key: ClassVar[str] = "centric_3"
    params_model: ClassVar[type[Params]] = CentricSettings
    gripper_type: ClassVar[str] = CENTRIC_3
    fingers: ClassVar[int] = 3

    def __init__(self, params: CentricSettings) -> None:
        super().__init__(params)
        self._nose_radius, self._nose_thickness = params.nose_radius_mm, params.nose_thickness_mm

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """A box from the gripping surface outwards; for a bore a prism that holds the cylinder's slice, frame F."""
        if grip == EXTERNAL:
            return super().finger(finger_length_mm, grip)
        radius, back = self._nose_radius, -self._nose_thickness
        slice_half = 180.0 / self.fingers  # degrees to either side
        flats = 2 * math.ceil(slice_half / _NOSE_STEP)  # an even number: the middle one is tangent
        half = slice_half / flats
        angles = np.radians(-slice_half + half + 2.0 * half * np.arange(flats))  # where two flats meet
        around = radius / math.cos(math.radians(half)) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        turn = math.radians(slice_half)
        ends = radius * np.array([[math.cos(turn), s * math.sin(turn)] for s in (-1, 1)])
        core = math.tan(turn) * (radius + back)
        section = np.concatenate([np.concatenate([around, ends]) - [radius, 0.0], [[back, -core], [back, core]]])  # (n, 2)
        section[:, 0] = np.where(np.abs(section[:, 0]) < 1e-12, 0.0, section[:, 0])
        vertices = np.concatenate([np.column_stack([section, np.full(len(section), z)]) for z in (-finger_length_mm, 0.0)])
        return (ConvexSolid(vertices_mm=vertices, role="finger"),)

    def opening_floor_mm(self, grip: str) -> float:
        """Fingers of width w meet at their inner edges when 2r = w / tan(π/n); slices when they make the cylinder."""
        if grip != EXTERNAL:
            return 2.0 * self._nose_radius
        return self._params.width_mm / (math.sqrt(3.0) if self.fingers == 3 else math.tan(math.pi / self.fingers))


class FourFingerHand(CentricHand):
    """Four straight fingers at 0°, 90°, 180° and 270° that move radially together."""

    key: ClassVar[str] = "centric_4"
    gripper_type: ClassVar[str] = CENTRIC_4
    fingers: ClassVar[int] = 4
