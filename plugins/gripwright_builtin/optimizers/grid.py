"""The paper's uniform grid of grippers (section 5.4), for comparison: it can miss the fewest."""

from dataclasses import replace

import numpy as np

from gripwright.domain.gripper import BOUND_TOLERANCE_MM as SLACK
from gripwright.domain.shape import FloatArray
from gripwright_builtin.optimizers.candidates import Demands


def on_grid(demands: Demands, steps: int) -> Demands:
    """The same demands where only `steps` even opening ranges and finger lengths of each class can be had.

    As in the paper, the largest openings lie between the narrowest range that holds the smallest width and the one that
    ends at the largest, the lengths between the least and the largest L⁻. What falls between two steps cannot be held.
    """
    reach_min, length_min, class_of = demands.reach_min_mm.copy(), demands.length_min_mm.copy(), demands.class_of.copy()
    for index in np.unique(class_of[class_of >= 0]):
        members = np.flatnonzero(demands.class_of == index)
        low, high, shortest = reach_min[members], demands.reach_max_mm[members], length_min[members]
        reach_min[members] = _step_up(low, np.linspace(min(high.min(), low.max()), low.max(), steps))
        length_min[members] = _step_up(shortest, np.linspace(shortest.min(), shortest.max(), steps))
        missed = (reach_min[members] > high + SLACK) | (length_min[members] > demands.length_max_mm[members] + SLACK)
        class_of[members[missed]] = -1
    return replace(demands, reach_min_mm=reach_min, length_min_mm=length_min, class_of=class_of)


def _step_up(values: FloatArray, steps: FloatArray) -> FloatArray:
    """For each value the next step that is not below it."""
    return np.asarray(steps[np.searchsorted(steps, values - SLACK)])
