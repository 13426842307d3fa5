"""Hands for the plug-ins that come after hand models."""

from collections.abc import Sequence

import numpy as np

from gripwright.domain.grasp import EXTERNAL
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import rotation_z
from gripwright.geometry.solids import box_vertices, prism_vertices
from gripwright.plugin_api import Params


class SampleHand:
    """Straight fingers of 8 × 10 mm before a round palm."""

    key = "sample"
    params_model = Params

    def __init__(self, gripper_type: str, fingers: int) -> None:
        self.gripper_type, self.fingers = gripper_type, fingers

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """X_GF, evenly about z."""
        found = np.stack([rotation_z(2.0 * np.pi * k / self.fingers) for k in range(self.fingers)])
        found[:, :3, 3] = found[:, :3, 0] * (opening_width_mm / 2.0)
        return found

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """One box."""
        low, high = (0.0, 8.0) if grip == EXTERNAL else (-8.0, 0.0)
        corners = box_vertices(np.array([low, -5.0, -finger_length_mm]), np.array([high, 5.0, 0.0]))
        return (ConvexSolid(vertices_mm=corners, role="finger"),)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """One prism."""
        corners = prism_vertices(envelope_mm, -finger_length_mm - depth_mm, -finger_length_mm)
        return (ConvexSolid(vertices_mm=corners, role="palm"),)

    def opening_floor_mm(self, grip: str) -> float:
        """Where fingers of that section meet."""
        return 6.0 if grip == EXTERNAL else 22.0


class SampleFace(SampleHand):
    """One round face on a straight stem of the same width."""

    def __init__(self, gripper_type: str, diameter_mm: float) -> None:
        super().__init__(gripper_type, 1)
        self._diameter_mm = diameter_mm

    def sized(self, opening_width_mm: float) -> "SampleFace":
        """Of that diameter."""
        return SampleFace(self.gripper_type, opening_width_mm)

    def finger_length_min_mm(self) -> float:
        """A disc would do."""
        return 5.0

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """About the gripper's axis."""
        return np.eye(4)[None]

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """One prism."""
        return (ConvexSolid(vertices_mm=prism_vertices(self._diameter_mm / 2.0, -finger_length_mm, 0.0), role="face"),)

    def opening_floor_mm(self, grip: str) -> float:
        """None."""
        return 0.0
