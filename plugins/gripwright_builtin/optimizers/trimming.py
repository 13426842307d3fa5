"""Opening ranges and alternatives that no optimum needs: left out before there is a candidate for each of their lengths.

- A range is too dear where even a gripper that held all its alternatives would be: its reduced cost, one less the dual
  prices of the components, exceeds what the fewest grippers cost above their bound.
- Within a range, an alternative is idle where its finger lengths are among those of another one of the same component:
  whoever holds it covers that component anyhow. It counts only where the alternatives held are themselves an objective.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray
from gripwright_builtin.optimizers.candidates import CriticalRange, Demands
from gripwright_builtin.optimizers.reduction import affordable


def without_dear(
    ranges: Iterable[CriticalRange], demands: Demands, prices: FloatArray, bound: float, most: float
) -> Iterator[CriticalRange]:
    """The ranges that sets of at most `most` grippers may contain, given `prices` (components,) that prove `bound`."""
    for one in ranges:
        worth = prices[np.unique(demands.component[one.members])].sum()
        if affordable(np.array([1.0 - worth]), bound, most)[0]:
            yield one


def without_idle(ranges: Iterable[CriticalRange], demands: Demands) -> Iterator[CriticalRange]:
    """The ranges without their idle alternatives."""
    for one in ranges:
        yield replace(one, members=_widest(one.members, demands))


def lengths_within(ranges: Iterable[CriticalRange], demands: Demands, most: int) -> list[CriticalRange] | None:
    """The ranges; None where they have more than `most` pairs of a range and one of its critical finger lengths."""
    kept: list[CriticalRange] = []
    pairs = 0
    for one in ranges:
        pairs += len(np.unique(demands.length_min_mm[one.members]))
        if pairs > most:
            return None
        kept.append(one)
    return kept


def _widest(members: IntArray, demands: Demands) -> IntArray:
    """Those alternatives whose interval of finger lengths no other one of the same component contains."""
    component, low, high = (table[members] for table in (demands.component, demands.length_min_mm, demands.length_max_mm))
    order = np.lexsort((-high, low, component))
    _, rank = np.unique(high, return_inverse=True)
    height = component[order] * (len(members) + 1) + rank[order] + 1  # grows from one component to the next
    highest_before = np.maximum.accumulate(np.concatenate(([-1], height[:-1])))
    return np.asarray(members[order[height > highest_before]])
