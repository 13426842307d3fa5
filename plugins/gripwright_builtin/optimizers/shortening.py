"""Shorter fingers for a gripper set that is too large to be optimised in full."""

from collections.abc import Sequence

import numpy as np

from gripwright.domain.gripper import GripperParameters
from gripwright.domain.shape import BoolArray, IntArray
from gripwright_builtin.optimizers.candidates import Candidates


def shortened(candidates: Candidates, grippers: Sequence[GripperParameters], held: BoolArray) -> IntArray:
    """For each gripper, the shortest candidate of its opening range so that no component is lost, the longest first.

    `held` is (grippers, components). Owned candidates that the others leave something to come before the grippers.
    """
    covers = candidates.covers  # (candidates, components)
    owned = np.flatnonzero(candidates.new == 0)
    by_owned = covers[owned].astype(bool).toarray()  # (owned, components)
    held = held & ~by_owned.any(axis=0)
    chosen: list[int] = [int(i) for i, mask in zip(owned, by_owned, strict=True) if (mask & ~held.any(axis=0)).any()]
    for g in sorted(range(len(grippers)), key=lambda g: -grippers[g].finger_length_mm):
        alone = held[g] & ~np.delete(held, g, axis=0).any(axis=0)  # (components,)
        same = np.array([_same_range(one, grippers[g]) for one in candidates.parameters])
        rivals = np.flatnonzero(same & (candidates.new > 0))
        able = rivals[covers[rivals] @ alone.astype(np.float64) >= alone.sum()]
        shortest = int(min(able, key=lambda i: (candidates.off_step[i], candidates.length_mm[i])))
        held[g] &= covers[[shortest]].astype(bool).toarray()[0]
        chosen.append(shortest)
    return np.array(chosen, dtype=np.int64)


def _same_range(one: GripperParameters, other: GripperParameters) -> bool:
    return one.gripper_type == other.gripper_type and one.opening_max_mm == other.opening_max_mm
