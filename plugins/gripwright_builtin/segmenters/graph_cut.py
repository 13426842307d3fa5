"""Labelling by alpha expansion (Boykov, Veksler and Zabih, 2001); each expansion is a minimum cut, solved to its optimum."""

import numpy as np
from ortools.graph.python.max_flow import SimpleMaxFlow

from gripwright.domain.shape import BoolArray, FloatArray, IntArray

COST_MAX = 2**28
"""Costs are rounded to integers, the largest to this: sums are then exact, and so is the cut."""
ROUNDS_MAX = 10


def alpha_expansion(data: FloatArray, pairs: IntArray, costs: FloatArray) -> IntArray:
    """A labelling (m,) that no expansion of any label improves.

    `data` (m, k) is the cost of each label, `costs` (e,) ≥ 0 that of different labels on the items of each pair.
    """
    scale = COST_MAX / max(float(data.max()), float(costs.max(initial=0.0)), np.finfo(float).tiny)
    unary = np.rint(data * scale).astype(np.int64)
    pairwise = 2 * np.rint(costs * scale / 2.0).astype(np.int64)  # even, so that halves are exact
    labels: IntArray = unary.argmin(axis=1)
    energy = labelling_energy(labels, unary, pairs, pairwise)
    count, unchanged = data.shape[1], 0
    for step in range(ROUNDS_MAX * count):
        candidate = expand(labels, step % count, unary, pairs, pairwise)
        better = labelling_energy(candidate, unary, pairs, pairwise)
        unchanged = 0 if better < energy else unchanged + 1
        if better < energy:
            labels, energy = candidate, better
        elif unchanged >= count:
            break
    return labels


def labelling_energy(labels: IntArray, unary: IntArray, pairs: IntArray, pairwise: IntArray) -> int:
    """Sum of the costs of a labelling."""
    differ = labels[pairs[:, 0]] != labels[pairs[:, 1]]
    return int(np.take_along_axis(unary, labels[:, None], axis=1).sum() + pairwise[differ].sum())


def expand(labels: IntArray, label: int, unary: IntArray, pairs: IntArray, pairwise: IntArray) -> IntArray:
    """The best labelling in which each item keeps its label or takes `label`; `pairwise` costs are even.

    Two items of one label pay for a border when they part; two items of different labels pay already, half of it each
    is saved by either's taking the label; an item beside one that has the label saves the border by taking it.
    """
    movable = labels != label
    items = np.flatnonzero(movable)
    number = np.cumsum(movable) - 1
    f, g = pairs.T
    differ = labels[f] != labels[g]
    inner = movable[f] & movable[g]
    saved = np.where(inner, pairwise // 2, pairwise) * differ
    take = unary[:, label] - np.take_along_axis(unary, labels[:, None], axis=1)[:, 0]
    for ends in (f, g):
        take -= np.bincount(ends, weights=saved, minlength=len(labels)).astype(np.int64)
    capacities = np.where(differ, pairwise // 2, pairwise)[inner]
    taken = minimum_cut(take[items], number[pairs[inner]], capacities)
    result = labels.copy()
    result[items[taken]] = label
    return result


def minimum_cut(take: IntArray, pairs: IntArray, capacities: IntArray) -> BoolArray:
    """Which items to take, (n,), so that their sum of `take` and the `capacities` of the pairs that part is least.

    Of several least choices the one that takes fewest.
    """
    source, sink = len(take), len(take) + 1
    flow = SimpleMaxFlow()
    heads, tails = np.concatenate((pairs, pairs[:, ::-1])).T
    flow.add_arcs_with_capacity(heads, tails, np.concatenate((capacities, capacities)))
    gain, loss = np.flatnonzero(take < 0), np.flatnonzero(take > 0)
    flow.add_arcs_with_capacity(np.full(len(gain), source), gain, -take[gain])
    flow.add_arcs_with_capacity(loss, np.full(len(loss), sink), take[loss])
    flow.add_arc_with_capacity(source, sink, 0)  # both exist, whatever the items ask for
    status = flow.solve(source, sink)
    if status != flow.OPTIMAL:
        raise ArithmeticError(f"maximum flow ended with status {status}")
    taken = np.zeros(len(take) + 2, dtype=bool)
    taken[flow.get_source_side_min_cut()] = True
    return taken[:-2]
