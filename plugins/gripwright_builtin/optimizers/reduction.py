"""What an optimum of a covering problem can do without: dominated rows and columns, and columns too dear by their duals."""

from collections.abc import Sequence

import numpy as np
import scipy.optimize
import scipy.sparse

from gripwright.domain.shape import BoolArray, FloatArray, IntArray

_SLACK = 1e-6  # of reduced costs, relative to the objective


def undominated(table: BoolArray, figures: FloatArray) -> IntArray:
    """Candidates that remain when those are left out that another one covers as much as and is no worse than in any figure.

    `table` is (candidates, what they cover), `figures` (candidates, f). An optimum of the rest, in any of the figures and
    under limits on any of them, is an optimum of the whole.
    """
    packed = np.packbits(table, axis=1)
    keys = np.concatenate([packed, np.ascontiguousarray(figures).view(np.uint8).reshape(len(table), -1)], axis=1)
    _, first = np.unique(keys, axis=0, return_index=True)
    first.sort()
    return np.asarray(first[~_dominated(table[first], figures[first])])


def prices(
    covers: scipy.sparse.csr_array, figures: FloatArray, limits: Sequence[tuple[FloatArray, float]]
) -> tuple[float, FloatArray, FloatArray]:
    """Least sum of fractions of candidates that cover each row within the limits, and the dual prices that prove it.

    `covers` is (candidates, rows); a limit is a figure (candidates,) and the most that its sum may be. The answer is the
    bound, a price a row, and a price (≤ 0) a limit; −inf where the solver gave up. A candidate whose reduced cost, its
    figure less the prices of its rows and limits, exceeds what an optimum costs above the bound is in no optimum.
    """
    rows = [-scipy.sparse.csr_array(covers.T), *(scipy.sparse.csr_array(figure[None, :]) for figure, _ in limits)]
    upper = np.concatenate([-np.ones(covers.shape[1]), [most for _, most in limits]])
    result = scipy.optimize.linprog(figures, A_ub=scipy.sparse.vstack(rows, format="csr"), b_ub=upper, bounds=(0.0, None))
    if result.status != 0 or result.fun is None:
        return -np.inf, np.zeros(covers.shape[1]), np.zeros(len(limits))
    duals = np.asarray(result.ineqlin.marginals)
    return float(result.fun), -duals[: covers.shape[1]], duals[covers.shape[1] :]


def greedy_cover(covers: scipy.sparse.csr_array) -> IntArray:
    """Some candidates that cover all components, by always taking the one that covers most of what is left."""
    chosen: list[int] = []
    left = np.ones(covers.shape[1])
    while left.any():
        best = int(np.argmax(covers @ left))
        chosen.append(best)
        left[covers[[best]].indices] = 0.0
    return np.array(chosen, dtype=np.int64)


def affordable(reduced_cost: FloatArray, bound: float, optimum: float) -> BoolArray:
    """(candidates,) those that some optimum may contain."""
    return np.asarray(reduced_cost <= optimum - bound + _SLACK * max(1.0, abs(optimum)))


def _dominated(table: BoolArray, figures: FloatArray) -> BoolArray:
    """(n,) whether another set contains this one and is no worse in any figure; no two are the same in all."""
    packed = np.packbits(table, axis=1)  # (n, bytes)
    padded = np.pad(packed, ((0, 0), (0, -packed.shape[1] % 8)))
    words = np.ascontiguousarray(padded).view(np.uint64)  # (n, words)
    size, frequency = table.sum(axis=1), table.sum(axis=0)
    owners = [np.flatnonzero(column) for column in table.T]
    out = np.zeros(len(table), dtype=bool)
    for i, row in enumerate(table):
        elements = np.flatnonzero(row)
        # Only sets that own the rarest element of this one can contain it.
        rivals = owners[elements[np.argmin(frequency[elements])]] if len(elements) else np.arange(len(table))
        rivals = rivals[~out[rivals] & (size[rivals] >= size[i]) & (rivals != i)]
        rivals = rivals[(figures[rivals] <= figures[i]).all(axis=1)]
        out[i] = not (words[i] & ~words[rivals]).any(axis=1).all()
    return out
