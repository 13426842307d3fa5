"""Dominance in a covering problem: rows and columns that an optimum can do without."""

import numpy as np
import scipy.sparse

from gripwright.domain.shape import BoolArray, FloatArray, IntArray


def reduce_cover(covers: scipy.sparse.csr_array, cost: FloatArray) -> tuple[IntArray, IntArray]:
    """Columns (candidates) and rows (components) that remain when dominated ones are left out, again and again.

    `covers` is (candidates, components). A candidate is dominated by one that covers as much for no more `cost`; a
    component by one whose every cover covers it too. An optimum of the rest is an optimum of the whole.
    """
    columns, rows = np.arange(covers.shape[0]), np.arange(covers.shape[1])
    table = covers.toarray() > 0  # (columns, rows)
    while True:
        kept = ~_dominated_columns(table, cost[columns])
        columns, table = columns[kept], table[kept]
        needed = ~_dominated_rows(table.T)
        rows, table = rows[needed], table[:, needed]
        if (kept.all() and needed.all()) or not len(rows):
            return columns, rows


def _dominated_columns(table: BoolArray, cost: FloatArray) -> BoolArray:
    """(n,) whether another set contains this one at no more cost; of equal ones the first stays."""
    sets = _Sets(table)
    out = np.zeros(len(table), dtype=bool)
    for i in range(len(table)):
        supersets = sets.containing(i, ~out & (cost <= cost[i]))
        out[i] = bool(((sets.size[supersets] > sets.size[i]) | (cost[supersets] < cost[i]) | (supersets < i)).any())
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
