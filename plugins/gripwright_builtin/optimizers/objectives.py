"""Objectives one after another, each under the optimum of those before it."""

import time

import numpy as np
import scipy.sparse

from gripwright.domain.shape import FloatArray, IntArray
from gripwright_builtin.optimizers.program import IntegerProgram, Outcome, Solver
from gripwright_builtin.optimizers.reduction import affordable, prices, reduce_cover

PROVEN = "proven"


class LexicographicCover:
    """Chooses candidates so that each component is covered, by one objective after another.

    After each objective, `chosen` is optimal in it among the choices that are optimal in all before; where the time did
    not suffice for that, `detail` says how far it may be off. Each objective is solved on what dominance leaves, and
    leaves to the next ones only candidates that may be in an optimum.
    """

    def __init__(self, covers: scipy.sparse.csr_array, holds: scipy.sparse.csr_array, solver: Solver, deadline_s: float) -> None:
        """`covers` is (candidates, components), `holds` (candidates, alternatives); `deadline_s` of `time.monotonic`."""
        self._covers = covers
        self._holds = holds
        self._solver: Solver = solver
        self._deadline_s = deadline_s
        self._alive: IntArray = np.arange(covers.shape[0])
        self._limits: list[tuple[FloatArray, float]] = []
        self._most_changes: float | None = None
        self._least_held: float | None = None
        self.bound = -np.inf  # of the last sum, by its relaxation
        self.prices: FloatArray = np.zeros(covers.shape[1])  # (components,) dual prices that prove it
        self.chosen: IntArray | None = None
        self.detail: dict[str, str] = {}  # objective → "proven", or what is known

    def limit(self, figures: FloatArray, most: float) -> None:
        """Allow only choices whose sum of a figure (candidates,) is at most `most`."""
        self._limits.append((figures, most))

    def limit_priced(self, figures: FloatArray, most: float, prices_: FloatArray, bound: float) -> None:
        """Allow only choices whose sum is at most `most`, given component prices that prove the bound of that sum."""
        self.limit(figures, most)
        reduced = figures - self._covers @ prices_
        self._alive = self._alive[affordable(reduced[self._alive], bound, most)]

    def least_sum(self, name: str, figures: FloatArray) -> float | None:
        """Least sum of a figure (candidates,) over the chosen ones."""
        columns, rows = self._reduced(self._alive, figures)
        program, _, _ = self._program(columns, rows)
        value = self._settle(name, columns, program, figures[columns])
        if value is not None:
            self._discard(columns, rows, figures, value)
            self.limit(figures, value)
        return value

    def least_maximum(self, name: str, figures: FloatArray) -> float | None:
        """Least of the largest figure (candidates,) among the chosen ones."""
        covers = self._covers[self._alive].tocsc()
        values = figures[self._alive]
        least = max(float(values[covers.indices[a:b]].min()) for a, b in zip(covers.indptr[:-1], covers.indptr[1:], strict=True))
        levels = np.unique(values[values >= least])
        low, high, proven = 0, len(levels) - 1, True
        trial = 0  # the least level is often enough
        while low < high:
            outcome = self._within(self._alive[values <= levels[trial]])
            proven = proven and outcome.proven
            if outcome.values is None:
                low = trial + 1
            else:
                high = trial
            trial = (low + high) // 2
        self._alive = self._alive[values <= levels[high]]
        self.detail[name] = PROVEN if proven else f"{levels[high]:.6g} reached in the time"
        return float(levels[high])

    def fewest_changes(self, name: str) -> float | None:
        """Fewest changes from one chosen candidate to another along the sequence of the components."""
        self._most_changes = float(self._covers.shape[1])
        columns, rows = self._reduced(self._alive)
        program, changes, _ = self._program(columns, rows)
        self._most_changes = self._settle(name, columns, program, changes)
        return self._most_changes

    def most_held(self, name: str) -> float | None:
        """Most alternatives held by the chosen ones."""
        self._least_held = 0.0
        columns, rows = self._reduced(self._alive)
        program, _, unheld = self._program(columns, rows)
        value = self._settle(name, columns, program, unheld)
        self._least_held = None if value is None else -value
        return self._least_held

    def _reduced(self, among: IntArray, figures: FloatArray | None = None) -> tuple[IntArray, IntArray]:
        """Candidates and components that this objective needs."""
        table = (self._holds if self._least_held is not None else self._covers)[among].toarray() > 0
        every = [*(figure for figure, _ in self._limits), *([] if figures is None else [figures])]
        weighed = np.stack([figure[among] for figure in every], axis=1) if every else np.zeros((len(among), 0))
        plain = self._most_changes is None and self._least_held is None
        columns, rows = reduce_cover(table, weighed, keep_rows=not plain)
        return among[columns], rows if plain else np.arange(self._covers.shape[1])

    def _program(self, columns: IntArray, rows: IntArray) -> tuple[IntegerProgram, FloatArray, FloatArray]:
        """The covering problem under all limits so far, and what counts the changes and (negative) the alternatives held."""
        program = IntegerProgram()
        program.add_variables(len(columns), integer=True)
        program.add_rows(scipy.sparse.csr_array(self._covers[columns][:, rows].T), lower=1.0)
        for figures, most in self._limits:
            program.keep(figures[columns], most)
        changes, unheld = np.zeros(0), np.zeros(0)
        if self._most_changes is not None:
            changes = _count_changes(program, self._covers[columns])
            program.keep(changes, self._most_changes)
        if self._least_held is not None:
            unheld = _count_held(program, self._holds[columns])
            program.keep(unheld, -self._least_held)
        return program, changes, unheld

    def _within(self, among: IntArray) -> Outcome:
        """Any choice among these candidates that keeps all limits."""
        columns, rows = self._reduced(among)
        if len(rows) and not self._covers[columns][:, rows].sum(axis=0).all():
            return Outcome(values=None, objective=np.inf, proven=True)
        program, _, _ = self._program(columns, rows)
        outcome = program.minimise(np.zeros(len(columns)), self._solver, self._deadline_s - time.monotonic())
        if outcome.values is not None:
            self.chosen = columns[outcome.values[: len(columns)] > 0.5]
        return outcome

    def _settle(self, name: str, columns: IntArray, program: IntegerProgram, objective: FloatArray) -> float | None:
        outcome = program.minimise(objective, self._solver, self._deadline_s - time.monotonic())
        if outcome.values is None:
            self.detail[name] = "not reached in the time"
            return None
        self.chosen = columns[outcome.values[: len(columns)] > 0.5]
        if outcome.proven:
            self.detail[name] = PROVEN
        else:
            bound = program.relaxation(objective)
            self.detail[name] = f"{outcome.objective:.6g} reached in the time, at least {bound:.6g} by relaxation"
        return outcome.objective

    def _discard(self, columns: IntArray, rows: IntArray, figures: FloatArray, optimum: float) -> None:
        """Leave to the next objectives the candidates that an optimum of this one may contain."""
        limits = [(figure[columns], most) for figure, most in self._limits]
        found = prices(self._covers[columns][:, rows], figures[columns], limits)
        if found is None:
            return
        self.bound, row_prices, limit_prices = found
        self.prices = np.zeros(self._covers.shape[1])
        self.prices[rows] = row_prices
        reduced = figures - self._covers @ self.prices
        for (figure, _), price in zip(self._limits, limit_prices.tolist(), strict=True):
            reduced = reduced - price * figure
        self._alive = self._alive[affordable(reduced[self._alive], self.bound, optimum)]


def _count_changes(program: IntegerProgram, covers: scipy.sparse.csr_array) -> FloatArray:
    """Variables for who does what; the answer's sum over all variables is the number of changes plus one."""
    users, operations = (indices.astype(np.int64) for indices in covers.nonzero())  # a pair each: this one can do that
    pairs = len(users)
    used, begins = program.add_variables(pairs, integer=False), program.add_variables(pairs, integer=False)
    index, one = np.arange(pairs), np.ones(pairs)
    linked = _table([-one, one], [index, index], [users, used + index], (pairs, program.size))
    program.add_rows(linked, upper=0.0)
    program.add_rows(_table([one], [operations], [used + index], (covers.shape[1], program.size)), lower=1.0)
    pair_of = {pair: i for i, pair in enumerate(zip(users.tolist(), operations.tolist(), strict=True))}
    previous = np.array([pair_of.get((user, operation - 1), -1) for user, operation in pair_of], dtype=np.int64)
    lasts = np.flatnonzero(previous >= 0)
    signs, columns = [one, -one, -np.ones(len(lasts))], [used + index, begins + index, used + previous[lasts]]
    program.add_rows(_table(signs, [index, index, lasts], columns, (pairs, program.size)), upper=0.0)
    objective = np.zeros(program.size)
    objective[begins : begins + pairs] = 1.0
    return objective


def _count_held(program: IntegerProgram, holds: scipy.sparse.csr_array) -> FloatArray:
    """Variables for the alternatives held; the answer's sum over all variables is minus their number."""
    users, alternatives = (indices.astype(np.int64) for indices in holds.nonzero())
    count = holds.shape[1]
    held = program.add_variables(count, integer=False)
    signs, rows = [-np.ones(len(users)), np.ones(count)], [alternatives, np.arange(count)]
    program.add_rows(_table(signs, rows, [users, held + np.arange(count)], (count, program.size)), upper=0.0)
    objective = np.zeros(program.size)
    objective[held : held + count] = -1.0
    return objective


def _table(
    data: list[FloatArray], rows: list[IntArray], columns: list[IntArray], shape: tuple[int, int]
) -> scipy.sparse.csr_array:
    return scipy.sparse.csr_array((np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
