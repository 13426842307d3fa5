"""Screw motions, and the nearest that a moving shape comes to a standing one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import RigidTransform

from checker.shapes import Array, Shape

STEP_MIN_MM = 0.02


@dataclass(frozen=True, eq=False)
class Screw:
    """A motion from the displacement `start` along a constant twist, finished at t = 1."""

    start: Array
    twist: Array  # (6,): rotation vector, translation; in the frame that stands still

    @classmethod
    def between(cls, start: Array, end: Array) -> Screw:
        return cls(start, RigidTransform.from_matrix(end @ np.linalg.inv(start)).as_exp_coords())

    @classmethod
    def straight(cls, way: Array, start: Array | None = None) -> Screw:
        """Along a way in the moving frame, from where that stands."""
        start = np.eye(4) if start is None else start
        return cls(start, np.concatenate([np.zeros(3), start[:3, :3] @ way]))

    def displacement(self, t: float) -> Array:
        """The 4×4 displacement at time t."""
        return np.asarray(RigidTransform.from_exp_coords(t * self.twist).as_matrix() @ self.start)

    def speed(self, vertices: Array) -> float:
        """The fastest vertex, mm per unit of time: a twist's speed does not change along its own motion."""
        points = vertices @ self.start[:3, :3].T + self.start[:3, 3]
        return float(np.linalg.norm(np.cross(self.twist[:3], points) + self.twist[3:], axis=1).max())


def screws(displacements: Sequence[Array]) -> list[Screw]:
    return [Screw.between(start, end) for start, end in pairwise(displacements)]


@dataclass(frozen=True)
class Approach:
    """The nearest that a motion came to something."""

    distance_mm: float
    inside: bool
    progress: float  # 0 at the start of the motion, 1 at its end

    def is_nearer(self, limit_mm: float) -> bool:
        return self.inside or self.distance_mm < limit_mm


def nearest_approach(
    moving: Shape, standing: Shape, motion: Sequence[Screw], limit_mm: float, accuracy: float, finer: int = 1
) -> Approach:
    """The smallest distance, to a share `accuracy` of it above the limit; ends at the first pose nearer than the limit.

    No step is longer than the distance just measured allows, so nothing can be jumped over but what reaches within the limit
    for less than `STEP_MIN_MM`. Steps are `finer` times as short.
    """
    if moving.is_inside(standing, motion[0].start):
        return Approach(0.0, True, 0.0)
    nearest = Approach(moving.distance(standing, motion[-1].displacement(1.0)), False, 1.0)
    for i, screw in enumerate(motion):
        speed = screw.speed(moving.vertices)
        t = 0.0
        while t <= 1.0 and not nearest.is_nearer(limit_mm):
            distance = moving.distance(standing, screw.displacement(t))
            if distance < nearest.distance_mm:
                nearest = Approach(distance, False, (i + t) / len(motion))
            passable = max((1 - accuracy) * nearest.distance_mm, limit_mm)
            step = max(distance - passable, STEP_MIN_MM) / finer
            t = t + step / speed if speed > 0 else np.inf
    return nearest
