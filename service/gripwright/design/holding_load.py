"""The loads of an operation on a grasp: weight and acceleration while it is carried, the insertion force at its end."""

import numpy as np

from gripwright.design.motion import sampled
from gripwright.domain.holding import Load
from gripwright.domain.shape import FloatArray

_POSES = 12  # along a motion that turns the component
_STILL = 1e-9


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
