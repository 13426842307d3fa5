"""The hand that both built-in gripper types share: straight fingers of rectangular section before a round palm."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.grasp import EXTERNAL
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import rotation_z
from gripwright.geometry.solids import box_vertices, prism_vertices
from gripwright.plugin_api.params import Params


class HandSettings(Params):
    """Section of the straight finger."""

    thickness_mm: float = Field(8.0, gt=0, le=100, description="mm, extent of the finger away from the gripping surface")
    width_mm: float = Field(10.0, gt=0, le=100, description="mm, width of the gripping surface")


class PrismHand:
    """Straight fingers, evenly spread, that move radially together."""

    params_model: ClassVar[type[Params]] = HandSettings
    fingers: ClassVar[int]

    def __init__(self, params: HandSettings) -> None:
        self._params = params

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """X_GF of each finger: Rz(θi)·Tx(W/2), (fingers, 4, 4)."""
        poses = np.stack([rotation_z(2.0 * np.pi * i / self.fingers) for i in range(self.fingers)])
        poses[:, :3, 3] = poses[:, :3, 0] * (opening_width_mm / 2.0)
        return poses

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """One box from the gripping surface outwards (inwards for an internal grip), frame F."""
        thickness, half = self._params.thickness_mm, self._params.width_mm / 2.0
        inner, outer = (0.0, thickness) if grip == EXTERNAL else (-thickness, 0.0)
        low, high = np.array([inner, -half, -finger_length_mm]), np.array([outer, half, 0.0])
        return (ConvexSolid(vertices_mm=box_vertices(low, high), role="finger"),)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """A prism around the cylinder of that radius, from z = −L back, frame G."""
        vertices = prism_vertices(envelope_mm, -finger_length_mm - depth_mm, -finger_length_mm)
        return (ConvexSolid(vertices_mm=vertices, role="palm"),)
