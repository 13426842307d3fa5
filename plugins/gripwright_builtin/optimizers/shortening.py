"""Shorter fingers for a gripper set that is too large to be optimised in full."""

import numpy as np

from gripwright.domain.shape import IntArray
from gripwright_builtin.optimizers.candidates import Candidates


def shortened(candidates: Candidates, chosen: IntArray) -> IntArray:
    """Each chosen candidate replaced by the shortest of the same opening range that loses no component, the longest first."""
    covers = candidates.covers.toarray() > 0  # (candidates, components)
    result = [int(i) for i in chosen]
    for place in sorted(range(len(result)), key=lambda p: -candidates.length_mm[result[p]]):
        gripper = result[place]
        others = covers[[i for p, i in enumerate(result) if p != place]].any(axis=0)
        alone = covers[gripper] & ~others  # (components,)
        rivals = np.flatnonzero([_same_range(candidates, gripper, i) for i in range(len(covers))])
        able = rivals[~(alone & ~covers[rivals]).any(axis=1)]
        result[place] = int(min(able, key=lambda i: (candidates.off_step[i], candidates.length_mm[i])))
    return np.array(result, dtype=np.int64)


def _same_range(candidates: Candidates, a: int, b: int) -> bool:
    one, other = candidates.parameters[a], candidates.parameters[b]
    return one.gripper_type == other.gripper_type and one.opening_max_mm == other.opening_max_mm
