"""Labelling by alpha expansion (Boykov, Veksler and Zabih, 2001); each expansion is a minimum cut, solved to its optimum."""

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray
from gripwright_builtin.segmenters.max_flow import Arcs, arcs_of, minimum_cut

COST_MAX = 2**28
"""Costs are rounded to integers, the largest to this: sums are then exact, and so is the cut."""
ROUNDS_MAX = 10


def alpha_expansion(data: FloatArray, pairs: IntArray, costs: FloatArray, start: IntArray | None = None) -> IntArray:
    """A labelling (m,) that no expansion of any label improves.

    `data` (m, k) is the cost of each label, `costs` (e,) ≥ 0 that of different labels on the items of each pair. It is
    found from `start`, a good guess at it, or from each item's cheapest label.
    """
    scale = COST_MAX / max(float(data.max()), float(costs.max(initial=0.0)), np.finfo(float).tiny)
    unary = np.rint(data * scale).astype(np.int64)
    pairwise = 2 * np.rint(costs * scale / 2.0).astype(np.int64)  # even, so that halves are exact
    labels: IntArray = unary.argmin(axis=1) if start is None else start
    energy = labelling_energy(labels, unary, pairs, pairwise)
    arcs = arcs_of(pairs, len(data))
    count, unchanged = data.shape[1], 0
    for step in range(ROUNDS_MAX * count):
        candidate = expand(labels, step % count, unary, pairs, pairwise, arcs)
        better = labelling_energy(candidate, unary, pairs, pairwise)
        unchanged = 0 if better < energy else unchanged + 1
        if better < energy:
            labels, energy = candidate, better
        elif unchanged >= count:
            break
    return labels


def expansion_coarse_to_fine(data: FloatArray, pairs: IntArray, costs: FloatArray, groups: IntArray) -> IntArray:
    """A labelling (m,) found with one label for each group of items, then with the groups at its borders dissolved."""
    labels = expansion_by_groups(data, pairs, costs, groups)
    at_border = groups[pairs[labels[pairs[:, 0]] != labels[pairs[:, 1]]]]
    dissolved = np.zeros(int(groups.max()) + 1, dtype=bool)
    dissolved[at_border] = True
    single = dissolved[groups]
    finer = np.where(single, len(dissolved) + np.cumsum(single), groups)
    return expansion_by_groups(data, pairs, costs, np.unique(finer, return_inverse=True)[1], labels)


def expansion_by_groups(
    data: FloatArray, pairs: IntArray, costs: FloatArray, groups: IntArray, start: IntArray | None = None
) -> IntArray:
    """The labelling (m,) that `alpha_expansion` finds where all items of a group (numbered from 0) have one label."""
    count = int(groups.max()) + 1
    summed = np.stack([np.bincount(groups, weights=column, minlength=count).astype(np.float64) for column in data.T], axis=1)
    ends = np.sort(groups[pairs], axis=1)
    apart = ends[:, 0] != ends[:, 1]
    keys, inverse = np.unique(ends[apart] @ np.array([count, 1]), return_inverse=True)
    joined = np.stack(np.divmod(keys, count), axis=1)
    joint_costs = np.bincount(inverse, weights=costs[apart], minlength=len(keys)).astype(np.float64)
    guess = None
    if start is not None:
        guess = np.empty(count, dtype=np.int64)
        guess[groups] = start
    return alpha_expansion(summed, joined, joint_costs, guess)[groups]


def labelling_energy(labels: IntArray, unary: IntArray, pairs: IntArray, pairwise: IntArray) -> int:
    """Sum of the costs of a labelling."""
    differ = labels[pairs[:, 0]] != labels[pairs[:, 1]]
    return int(np.take_along_axis(unary, labels[:, None], axis=1).sum() + pairwise[differ].sum())


def expand(
    labels: IntArray, label: int, unary: IntArray, pairs: IntArray, pairwise: IntArray, arcs: Arcs | None = None
) -> IntArray:
    """The best labelling in which each item keeps its label or takes `label`; `pairwise` costs are even.

    Two items of one label pay for a border when they part; two items of different labels pay already, half of it each
    is saved by either's taking the label; an item beside one that has the label saves the border by taking it.
    """
    movable = labels != label
    f, g = pairs.T
    differ = labels[f] != labels[g]
    inner = movable[f] & movable[g]
    saved = np.where(inner, pairwise // 2, pairwise) * differ
    take = unary[:, label] - np.take_along_axis(unary, labels[:, None], axis=1)[:, 0]
    for ends in (f, g):
        take -= np.bincount(ends, weights=saved, minlength=len(labels)).astype(np.int64)
    capacities = np.where(differ, pairwise // 2, pairwise) * inner
    taken = minimum_cut(take * movable, pairs, capacities, arcs)
    return np.where(taken & movable, label, labels)
