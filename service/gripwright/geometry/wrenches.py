"""The forces and moments that a grasp has to hold: weight and acceleration on the way, the insertion force at its end."""

from functools import cache

import numpy as np

from gripwright.domain.holding import Load
from gripwright.domain.shape import FloatArray

GRAVITY_M_S2 = 9.81
ACCELERATION_M_S2 = 5.0
"""Of the robot while it carries, in any direction."""


def wrenches(load: Load, about_C: FloatArray, R_CG: FloatArray) -> FloatArray:
    """All wrenches (k, 6) that the grasp has to hold: force in N and moment in N·mm about a point, component frame.

    Carried: weight and acceleration, in 98 directions about the hand and along the weight. Inserted, slowly: the insertion
    force, with the weight and with a weight that the seat bears. They act on the component.
    """
    ways = _directions() @ R_CG.T
    along = np.concatenate([load.gravity_C, -load.gravity_C])
    pulls = np.concatenate([ways, along]) * ACCELERATION_M_S2
    carried = (load.mass_kg * (GRAVITY_M_S2 * load.gravity_C[:, None] + pulls)).reshape(-1, 3)
    point, direction = load.insertion_C
    inserted = _wrench(-load.force_N * direction, point - about_C)
    weight = _wrench(load.mass_kg * GRAVITY_M_S2 * load.gravity_C[-1], load.centroid_C - about_C)
    return np.vstack([_wrench(carried, load.centroid_C - about_C), inserted, inserted + weight])


def _wrench(forces: FloatArray, arm: FloatArray) -> FloatArray:
    return np.concatenate([forces, np.cross(arm, forces)], axis=-1)


@cache
def _directions() -> FloatArray:
    """98 unit vectors, at most 15° from any other direction: the weight and acceleration they miss is below 2 %."""
    grid = np.stack(np.meshgrid(*[np.arange(-2.0, 3.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    shell = grid[np.abs(grid).max(axis=1) == 2.0]
    return np.asarray(shell / np.linalg.norm(shell, axis=1, keepdims=True))
