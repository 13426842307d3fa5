"""What an optimum of a covering problem can do without: dominated rows and columns, and columns too dear by their duals."""

from collections.abc import Sequence

import numpy as np
import scipy.optimize
import scipy.sparse

from gripwright.domain.shape import BoolArray, FloatArray, IntArray

_SLACK = 1e-6  # of reduced costs, relative to the objective


def reduce_cover(table: BoolArray, figures: FloatArray, *, keep_rows: bool = False) -> tuple[IntArray, IntArray]:
    """Columns (candidates) and rows (components) that remain when dominated ones are left out, again and again.

    `table` is (candidates, components), `figures` (candidates, f). A candidate is dominated by one that covers as much and
    is no worse in any figure; a component by one whose every cover covers it too. An optimum of the rest, in any figure
    and under limits on any, is an optimum of the whole. With `keep_rows` components stay.
    """
    columns, rows = np.arange(table.shape[0]), np.arange(table.shape[1])
    while True:
        kept = ~_dominated_columns(table, figures[columns])
        columns, table = columns[kept], table[kept]
        needed = np.ones(len(rows), dtype=bool) if keep_rows else ~_dominated_rows(table.T)
        rows, table = rows[needed], table[:, needed]
        if (kept.all() and needed.all()) or not len(rows):
            return columns, rows


def prices(
    covers: scipy.sparse.csr_array, figures: FloatArray, limits: Sequence[tuple[FloatArray, float]]
) -> tuple[float, FloatArray, FloatArray] | None:
    """Least sum of fractions of candidates that cover each row within the limits, and the dual prices that prove it.

    `covers` is (candidates, rows); a limit is a figure (candidates,) and the most that its sum may be. The answer is the
    bound, a price a row, and a price (≤ 0) a limit; None where the solver gave up. A candidate whose reduced cost, its
    figure less the prices of its rows and limits, exceeds what an optimum costs above the bound is in no optimum.
    """
    rows = [-scipy.sparse.csr_array(covers.T), *(scipy.sparse.csr_array(figure[None, :]) for figure, _ in limits)]
    upper = np.concatenate([-np.ones(covers.shape[1]), [most for _, most in limits]])
    result = scipy.optimize.linprog(figures, A_ub=scipy.sparse.vstack(rows, format="csr"), b_ub=upper, bounds=(0.0, None))
    if result.status != 0 or result.fun is None:
        return None
    duals = np.asarray(result.ineqlin.marginals)
    return float(result.fun), -duals[: covers.shape[1]], duals[covers.shape[1] :]


def affordable(reduced_cost: FloatArray, bound: float, optimum: float) -> BoolArray:
    """(candidates,) those that some optimum may contain."""
    return np.asarray(reduced_cost <= optimum - bound + _SLACK * max(1.0, abs(optimum)))


def _dominated_columns(table: BoolArray, figures: FloatArray) -> BoolArray:
    """(n,) whether another set contains this one and is no worse in any figure; of equal ones the first stays."""
    sets = _Sets(table)
    out = np.zeros(len(table), dtype=bool)
    for i in range(len(table)):
        rivals = sets.containing(i, ~out)
        rivals = rivals[(figures[rivals] <= figures[i]).all(axis=1)]
        better = (sets.size[rivals] > sets.size[i]) | (figures[rivals] < figures[i]).any(axis=1) | (rivals < i)
        out[i] = bool(better.any())
    return out


def _dominated_rows(table: BoolArray) -> BoolArray:
    """(n,) whether this set contains another one; of equal ones the first stays."""
    sets = _Sets(table)
    out = np.zeros(len(table), dtype=bool)
    for i in np.argsort(sets.size, kind="stable"):
        if not out[i]:
            out[sets.containing(int(i), ~out)] = True
    return out


class _Sets:
    """The rows of a table as sets of its columns, packed in words of 64."""

    def __init__(self, table: BoolArray) -> None:
        packed = np.packbits(table, axis=1)  # (n, bytes)
        padded = np.pad(packed, ((0, 0), (0, -packed.shape[1] % 8)))
        self._words = np.ascontiguousarray(padded).view(np.uint64)  # (n, words)
        self._elements = [np.flatnonzero(row) for row in table]
        self._owners = [np.flatnonzero(column) for column in table.T]
        self._frequency = table.sum(axis=0)
        self.size = table.sum(axis=1)

    def containing(self, i: int, among: BoolArray) -> IntArray:
        """The other sets that contain set i; only those that own its rarest element need a look."""
        elements = self._elements[i]
        rivals = self._owners[elements[np.argmin(self._frequency[elements])]] if len(elements) else np.arange(len(self.size))
        rivals = rivals[among[rivals] & (self.size[rivals] >= self.size[i]) & (rivals != i)]
        return np.asarray(rivals[~(self._words[i] & ~self._words[rivals]).any(axis=1)])
