"""The loads of an operation on a grasp: weight and acceleration while it is carried, the insertion force at its end."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from gripwright.design.motion import sampled
from gripwright.domain.shape import FloatArray

GRAVITY_M_S2 = 9.81
ACCELERATION_M_S2 = 5.0  # of the robot while it carries, any direction
_POSES = 12  # along a motion that turns the component
_STILL = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Load:
    """What an operation asks of a grasp, seen from the held component. It is the same for all its grasps."""

    mass_kg: float  # of everything that moves
    force_N: float  # insertion force
    centroid_C: FloatArray  # (3,) of everything that moves
    gravity_C: FloatArray  # (g, 3) unit directions that the weight takes along the motion, the last at its end
    insertion_C: FloatArray  # (2, 3) where the insertion force acts, and the unit direction of the motion there, at its end


def operation_load(
    motion: FloatArray,
    X_PC: FloatArray,
    centroid_C: FloatArray,
    mass_kg: float,
    force_N: float,
    force_point_C: FloatArray | None = None,
) -> Load:
    """The load of an operation: `motion` (k, 4, 4) displaces the component from its place `X_PC`.

    The insertion force acts at `force_point_C`, by default the centroid: against the velocity of that point at the
    motion's end, or upwards where the motion does not move it.
    """
    turning = np.ptp(motion[:, :3, :3], axis=0).max() > _STILL
    poses = np.array(sampled(motion, _POSES)) if turning else motion[-1:]
    down = -(poses[:, :3, :3] @ X_PC[:3, :3])[:, 2, :]  # (p, 3): −z of the product frame seen from C
    point_C = centroid_C if force_point_C is None else force_point_C
    places = ((poses if turning else motion) @ X_PC @ np.append(point_C, 1.0))[:, :3]
    return Load(
        mass_kg=mass_kg,
        force_N=force_N,
        centroid_C=centroid_C,
        gravity_C=np.vstack([_distinct(down[:-1], down[-1]), down[-1:]]),
        insertion_C=np.stack([point_C, _last_direction(places, motion[-1] @ X_PC, down[-1])]),
    )


def wrenches(load: Load, about_C: FloatArray, R_CG: FloatArray) -> FloatArray:
    """All wrenches (k, 6) that the grasp has to hold: force in N and moment in N·mm about a point, component frame.

    Carried: weight and acceleration, in 98 directions about the hand and along the weight. Inserted, slowly: the insertion
    force, with the weight and with a weight that the seat bears.
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


def _distinct(directions: FloatArray, but: FloatArray) -> FloatArray:
    """The directions without repetition, and without `but`."""
    kept = [row for row in directions if np.linalg.norm(row - but) > 1e-6]
    return np.unique(np.round(kept, 7), axis=0) if kept else np.empty((0, 3))


def _last_direction(places: FloatArray, X_PC: FloatArray, down_C: FloatArray) -> FloatArray:
    """Direction from the last other place to the end, seen from C at the end; down where there is none."""
    ways = places[-1] - places[:-1]
    lengths = np.linalg.norm(ways, axis=1)
    moved = np.flatnonzero(lengths > 1e-6)
    if not len(moved):
        return down_C
    return np.asarray(X_PC[:3, :3].T @ ways[moved[-1]] / lengths[moved[-1]])


@cache
def _directions() -> FloatArray:
    """98 unit vectors, at most 15° from any other direction: the weight and acceleration they miss is below 2 %."""
    grid = np.stack(np.meshgrid(*[np.arange(-2.0, 3.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    shell = grid[np.abs(grid).max(axis=1) == 2.0]
    return np.asarray(shell / np.linalg.norm(shell, axis=1, keepdims=True))
