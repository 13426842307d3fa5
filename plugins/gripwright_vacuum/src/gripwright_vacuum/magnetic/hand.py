"""The hand of a magnet with a round pole shoe."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.geometry.solids import prism_vertices
from gripwright.plugin_api import Params
from gripwright_vacuum.gripper_types import MAGNETIC_1

_SIDES = 32
_SHORTEST_MM = 6.0


class MagneticHandSettings(Params):
    """The pole of the hand as it comes; the host sizes it."""

    diameter: float = Field(20.0, ge=6.0, le=150.0, description="mm, of the pole face")


class MagneticHand:
    """One pole shoe about the gripper's axis, as wide as its face all along."""

    key: ClassVar[str] = "magnetic_1"
    params_model: ClassVar[type[Params]] = MagneticHandSettings
    gripper_type: ClassVar[str] = MAGNETIC_1
    fingers: ClassVar[int] = 1

    def __init__(self, params: MagneticHandSettings) -> None:
        self._radius = params.diameter / 2.0

    def sized(self, opening_width_mm: float) -> "MagneticHand":
        """The hand with a pole face of that diameter."""
        return MagneticHand(MagneticHandSettings.model_construct(diameter=opening_width_mm))

    def finger_length_min_mm(self) -> float:
        """A short shoe."""
        return _SHORTEST_MM

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """The gripper's own frame, (1, 4, 4)."""
        return np.eye(4)[None]

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """One cylinder."""
        return (ConvexSolid(vertices_mm=prism_vertices(self._radius, -finger_length_mm, 0.0, _SIDES), role="pole shoe"),)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """A prism around the cylinder of that radius, from z = −L back."""
        return (
            ConvexSolid(vertices_mm=prism_vertices(envelope_mm, -finger_length_mm - depth_mm, -finger_length_mm), role="palm"),
        )

    def opening_floor_mm(self, grip: str) -> float:
        """None: a magnet does not close."""
        return 0.0
