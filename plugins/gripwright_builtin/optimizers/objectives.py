"""Objectives one after another, each under the optimum of those before it."""

import time

import numpy as np
import scipy.sparse

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright_builtin.optimizers.program import IntegerProgram, Solver

PROVEN = "proven"


class LexicographicCover:
    """Chooses candidates so that each component is covered, by one objective after another.

    After each objective, `chosen` is optimal in it among the choices that are optimal in all before; where the time did
    not suffice for that, `detail` says how far it may be off.
    """

    def __init__(self, covers: scipy.sparse.csr_array, solver: Solver, deadline_s: float) -> None:
        """`covers` is (candidates, components); `deadline_s` is a time of `time.monotonic`."""
        self._covers = covers
        self._solver: Solver = solver
        self._deadline_s = deadline_s
        self._program = IntegerProgram()
        self._program.add_variables(covers.shape[0], integer=True)
        self._program.add_rows(scipy.sparse.csr_array(covers.T), lower=1.0)
        self.chosen: BoolArray = np.zeros(covers.shape[0], dtype=bool)  # (candidates,)
        self.detail: dict[str, str] = {}  # objective → "proven", or what is known

    def least_sum(self, name: str, figures: FloatArray) -> float | None:
        """Least sum of a figure (candidates,) over the chosen ones."""
        return self._minimise(name, figures)

    def least_maximum(self, name: str, figures: FloatArray) -> float | None:
        """Least of the largest figure (candidates,) among the chosen ones."""
        bound = self._program.add_variables(1, integer=False, limit=float(figures.max(initial=0.0)))
        index = np.arange(len(figures))
        rows, columns = np.tile(index, 2), np.concatenate([index, np.full(len(index), bound.start)])
        signs = np.concatenate([figures, -np.ones(len(figures))])
        self._program.add_rows(_table(signs, rows, columns, (len(index), bound.stop)), upper=0.0)
        objective = np.zeros(self._program.size)
        objective[bound] = 1.0
        return self._minimise(name, objective)

    def most_held(self, name: str, holds: scipy.sparse.csr_array) -> float | None:
        """Most alternatives held by the chosen ones; `holds` is (candidates, alternatives)."""
        held = self._program.add_variables(holds.shape[1], integer=False)
        self._program.add_rows(self._linked(-scipy.sparse.csr_array(holds.T), held), upper=0.0)
        objective = np.zeros(self._program.size)
        objective[held] = -1.0
        return self._minimise(name, objective)

    def fewest_changes(self, name: str) -> float | None:
        """Fewest changes from one chosen candidate to another along the sequence of the components."""
        users, operations = (indices.astype(np.int64) for indices in self._covers.nonzero())  # pairs: this one can do that
        n, pairs = self._covers.shape[0], len(users)
        used = self._program.add_variables(pairs, integer=False)
        begins = self._program.add_variables(pairs, integer=False)
        one = np.ones(pairs)
        index = np.arange(pairs)
        self._program.add_rows(self._linked(-_table(one, index, users, (pairs, n)), used), upper=0.0)
        each = _table(one, operations, used.start + index, (self._covers.shape[1], used.stop))
        self._program.add_rows(each, lower=1.0)
        before = {(u, o): i for i, (u, o) in enumerate(zip(users.tolist(), operations.tolist(), strict=True))}
        previous = np.array([before.get((u, o - 1), -1) for u, o in before], dtype=np.int64)
        known = previous >= 0
        rows = np.concatenate([index, index, index[known]])
        columns = np.concatenate([used.start + index, begins.start + index, used.start + previous[known]])
        signs = np.concatenate([one, -one, -one[known]])
        self._program.add_rows(_table(signs, rows, columns, (pairs, begins.stop)), upper=0.0)
        objective = np.zeros(self._program.size)
        objective[begins] = 1.0
        return self._minimise(name, objective)

    def limit(self, figures: FloatArray, most: float) -> None:
        """Allow only choices whose sum of a figure is at most `most`."""
        self._program.keep(figures, most)

    def bound(self, figures: FloatArray) -> float:
        """A lower bound on the sum of a figure over the chosen ones."""
        return self._program.relaxation_bound(figures)

    def _linked(self, left: scipy.sparse.csr_array, added: slice) -> scipy.sparse.csr_array:
        """Rows that join the first variables to the added ones, one to each: left · first + added."""
        middle = scipy.sparse.csr_array((left.shape[0], added.start - left.shape[1]))
        return scipy.sparse.csr_array(scipy.sparse.hstack([left, middle, scipy.sparse.eye_array(left.shape[0])]))

    def _minimise(self, name: str, objective: FloatArray) -> float | None:
        solution = self._program.minimise(objective, self._solver, self._deadline_s - time.monotonic())
        if solution is None:
            self.detail[name] = "not reached in the time"
            return None
        self.chosen = solution.values[: self._covers.shape[0]] > 0.5
        self._program.keep(objective, solution.objective)
        if solution.proven:
            self.detail[name] = PROVEN
        else:
            bound = self._program.relaxation_bound(objective)
            self.detail[name] = f"{solution.objective:.6g} reached in the time, at least {bound:.6g} by relaxation"
        return solution.objective


def _table(data: FloatArray, rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> scipy.sparse.csr_array:
    return scipy.sparse.csr_array((data, (rows, columns)), shape=shape)
