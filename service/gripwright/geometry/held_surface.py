"""A component's triangles, ready to be asked by many grasps what lies where. Lengths in mm."""

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, Mesh
from gripwright.geometry.clipping import clip_to_box, near_box
from gripwright.geometry.frames import inverse, transform

TOUCH_GAP_MM = 0.045
"""What lies nearer touches: 0.05 mm, a little in reserve, so that whoever measures the finished CAD finds the contact too."""
PARALLEL_RAD = float(np.radians(4.8))
"""Surfaces that touch are parallel to within that: 5°, with a little in reserve."""
SEAT_MM = 0.0005
"""What holds stands off the surface's foremost point by that, so that rounding in files never makes it enter."""


class Surface:
    """A component's triangles, ready for many grasps."""

    def __init__(self, mesh: Mesh) -> None:
        self.vertices = mesh.vertices_mm  # (n, 3)
        self.triangles = mesh.triangles_mm  # (m, 3, 3)
        cross = np.cross(self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0])
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        self.normals: FloatArray = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
        self.centres: FloatArray = self.triangles.mean(axis=1)
        self.reach: FloatArray = np.linalg.norm(self.triangles - self.centres[:, None], axis=2).max(axis=1)

    def near(self, point: FloatArray, radius: float) -> FloatArray:
        """Indices of triangles that may come within `radius` of the point."""
        distance = np.linalg.norm(self.centres - point, axis=1)
        return np.asarray(np.flatnonzero(distance <= radius + self.reach))

    def within(self, X_CF: FloatArray, low: FloatArray, high: FloatArray, chosen: BoolArray | None = None) -> FloatArray:
        """The parts of the triangles in low ≤ p ≤ high of a frame F, seen from it, (k, 3, 3); of the chosen ones (m,) alone."""
        X_FC = inverse(X_CF)
        near = near_box(self.centres, self.reach, X_FC, low, high)
        if chosen is not None:
            near = near[chosen[near]]
        if not len(near):
            return np.empty((0, 3, 3))
        return clip_to_box(transform(X_FC, self.triangles[near]), low, high)
