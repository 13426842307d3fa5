"""The groove of a concave fingertip. Lengths in mm."""

import math
from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Groove:
    """Part of a cylinder parallel to z, from corner to corner of the tip, finger frame of an external grip.

    It passes through (0, ±width/2) and is deepest at y = 0: there a component of a smaller radius touches.
    """

    radius_mm: float
    width_mm: float  # of the tip

    @property
    def axis_x_mm(self) -> float:
        """Where the cylinder's axis stands; negative."""
        return -math.sqrt(self.radius_mm**2 - (self.width_mm / 2.0) ** 2)

    @property
    def depth_mm(self) -> float:
        """How far from the plane x = 0 the tip touches: the contact offset."""
        return self.axis_x_mm + self.radius_mm

    def chords_mm(self, deviation_mm: float) -> FloatArray:
        """Corners (k, 2) of a polygon in the groove, ascending in y, nowhere farther than that from the cylinder."""
        half = math.asin(self.width_mm / 2.0 / self.radius_mm)
        step = 2.0 * math.acos(1.0 - deviation_mm / self.radius_mm)
        angles = np.linspace(-half, half, 2 * math.ceil(half / step) + 1)
        corners = self.radius_mm * np.stack([np.cos(angles), np.sin(angles)], axis=1) + [self.axis_x_mm, 0.0]
        corners[[0, -1]] = [[0.0, -self.width_mm / 2.0], [0.0, self.width_mm / 2.0]]
        return corners
