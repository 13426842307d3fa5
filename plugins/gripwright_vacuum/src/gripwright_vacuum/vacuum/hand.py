"""The hand of a suction cup on a stem."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.geometry.solids import prism_vertices
from gripwright.plugin_api import Params
from gripwright_vacuum.gripper_types import VACUUM_1
from gripwright_vacuum.vacuum.cup import CupMeasures

_SIDES = 32


class VacuumHandSettings(Params):
    """The cup of the hand as it comes; the host sizes it."""

    diameter: float = Field(20.0, ge=5.0, le=150.0, description="mm, of the lip")


class VacuumHand:
    """One cup about the gripper's axis, its stem behind it."""

    key: ClassVar[str] = "vacuum_1"
    params_model: ClassVar[type[Params]] = VacuumHandSettings
    gripper_type: ClassVar[str] = VACUUM_1
    fingers: ClassVar[int] = 1

    def __init__(self, params: VacuumHandSettings) -> None:
        self._cup = CupMeasures(diameter_mm=params.diameter)

    def sized(self, opening_width_mm: float) -> "VacuumHand":
        """The hand with a cup of that lip."""
        return VacuumHand(VacuumHandSettings.model_construct(diameter=opening_width_mm))

    def finger_length_min_mm(self) -> float:
        """The cup and its stud."""
        return self._cup.length_min_mm

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """The gripper's own frame, (1, 4, 4)."""
        return np.eye(4)[None]

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """The cup as a cylinder of its lip's diameter, and the stem."""
        cup = self._cup
        back = -min(cup.height_mm, finger_length_mm)
        return (
            ConvexSolid(vertices_mm=prism_vertices(cup.diameter_mm / 2.0, back, 0.0, _SIDES), role="cup"),
            ConvexSolid(vertices_mm=prism_vertices(cup.stem_radius_mm, -finger_length_mm, -cup.lip_height_mm / 2.0), role="stem"),
        )

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """A prism around the cylinder of that radius, from z = −L back."""
        return (
            ConvexSolid(vertices_mm=prism_vertices(envelope_mm, -finger_length_mm - depth_mm, -finger_length_mm), role="palm"),
        )

    def opening_floor_mm(self, grip: str) -> float:
        """None: a cup does not close."""
        return 0.0
