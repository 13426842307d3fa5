"""Objectives one after another, each under the optimum of those before it."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse

from gripwright.domain.shape import FloatArray, IntArray
from gripwright_builtin.optimizers.program import IntegerProgram, Outcome, Solver
from gripwright_builtin.optimizers.reduction import affordable, prices, undominated

PROVEN = "proven"

_ROWS_FIRST = 300  # components that a program begins with
_ROWS_MORE = 0.4  # components added at a time, of those already there


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Model:
    """The covering problem under all limits so far; the first variables stand for `columns`."""

    program: IntegerProgram
    columns: IntArray  # candidates
    changes: FloatArray  # its sum over the variables is the number of changes plus one
    unheld: FloatArray  # its sum over the variables is minus the number of alternatives held


class LexicographicCover:
    """Chooses candidates so that each component is covered, by one objective after another.

    After each objective, `chosen` is optimal in it among the choices that are optimal in all before; where the time did
    not suffice for that, `detail` says how far it may be off. Each is solved on the candidates that dominance leaves and
    on few components; those that the optimum does not cover are added until it covers all: then it is the optimum. It
    leaves to the next objectives only candidates that may be in an optimum.
    """

    def __init__(self, covers: scipy.sparse.csr_array, holds: scipy.sparse.csr_array, solver: Solver, deadline_s: float) -> None:
        """`covers` is (candidates, components), `holds` (candidates, alternatives); `deadline_s` of `time.monotonic`."""
        self._covers = covers
        self._by_component = covers.tocsc()
        self._holds = holds
        self._solver: Solver = solver
        self._deadline_s = deadline_s
        self._alive: IntArray = np.arange(covers.shape[0])
        self._hardest_first: IntArray = np.argsort(np.diff(self._by_component.indptr), kind="stable")
        self._rows: IntArray = self._hardest_first[:_ROWS_FIRST]
        self._limits: list[tuple[FloatArray, float]] = []
        self._most_changes: float | None = None
        self._least_held: float | None = None
        self.bound = -np.inf  # of the last sum, by its relaxation
        self.prices: FloatArray = np.zeros(covers.shape[1])  # (components,) dual prices that prove it
        self._limit_prices: FloatArray = np.zeros(0)  # (limits,) those of the limits
        self.chosen: IntArray | None = None
        self.detail: dict[str, str] = {}  # objective → "proven", or what is known

    def limit(self, figures: FloatArray, most: float, prices: FloatArray, bound: float) -> None:
        """Allow only choices whose sum is at most `most`, given component prices that prove the bound of that sum."""
        self._limits.append((figures, most))
        reduced = figures - self._covers @ prices
        self._alive = self._alive[affordable(reduced[self._alive], bound, most)]

    def least_sum(self, name: str, figures: FloatArray) -> None:
        """Least sum of a figure (candidates,) over the chosen ones; no later objective makes it more than was reached."""
        model, outcome = self._solve(self._alive, lambda model: figures[model.columns], [figures])
        self._price(model.columns, figures)
        found = self._note(name, outcome, self.bound, figures)
        if self.chosen is None:
            return
        reached = outcome.objective if found else float(figures[self.chosen].sum())
        self._discard(figures, reached)
        self._limits.append((figures, reached))

    def least_maximum(self, name: str, figures: FloatArray) -> None:
        """Least of the largest figure (candidates,) among the chosen ones."""
        values = figures[self._alive]
        levels = np.unique(values[values >= self._least_level(values)])
        low, high, proven = 0, len(levels) - 1, True
        trial = 0  # the least level is often enough
        while low < high:
            _, outcome = self._solve(self._alive[values <= levels[trial]], lambda model: np.zeros(len(model.columns)))
            proven = proven and outcome.proven
            if outcome.values is None:
                low = trial + 1
            else:
                high = trial
            trial = (low + high) // 2
        self._alive = self._alive[values <= levels[high]]
        self.detail[name] = PROVEN if proven else f"{levels[high]:.6g} reached in the time"

    def fewest_changes(self, name: str) -> None:
        """Fewest changes from one chosen candidate to another along the sequence of the components."""
        self._rows = np.arange(self._covers.shape[1])
        self._most_changes = float(self._covers.shape[1])
        model, outcome = self._solve(self._alive, lambda model: model.changes)
        self._most_changes = (
            outcome.objective if self._note(name, outcome, self._relaxed(model, model.changes, outcome)) else None
        )

    def most_held(self, name: str) -> None:
        """Most alternatives held by the chosen ones."""
        self._least_held = 0.0
        model, outcome = self._solve(self._alive, lambda model: model.unheld)
        self._least_held = -outcome.objective if self._note(name, outcome, self._relaxed(model, model.unheld, outcome)) else None

    def _solve(
        self, among: IntArray, objective: Callable[[_Model], FloatArray], figures: Sequence[FloatArray] = ()
    ) -> tuple[_Model, Outcome]:
        """The best choice among these candidates that keeps all limits."""
        while True:
            model = self._model(among, figures)
            outcome = model.program.minimise(objective(model), self._solver, self._deadline_s - time.monotonic())
            if outcome.values is None:
                return model, outcome
            chosen = model.columns[outcome.values[: len(model.columns)] > 0.5]
            missing = np.asarray(self._covers[chosen].sum(axis=0)) == 0
            if not missing.any():
                self.chosen = chosen
                return model, outcome
            if not outcome.proven:
                return model, Outcome(values=None, objective=np.inf, proven=False)
            more = self._hardest_first[missing[self._hardest_first]][: math.ceil(_ROWS_MORE * len(self._rows))]
            self._rows = np.concatenate([self._rows, more])

    def _model(self, among: IntArray, figures: Sequence[FloatArray]) -> _Model:
        table = self._covers[among][:, self._rows] if self._least_held is None else self._holds[among]
        weighed = [figure[among] for figure in (*(figure for figure, _ in self._limits), *figures)] or [np.zeros(len(among))]
        columns = among[undominated(table.astype(bool).toarray(), np.stack(weighed, axis=1))]
        program = IntegerProgram()
        program.add_variables(len(columns), integer=True)
        program.add_rows(scipy.sparse.csr_array(self._covers[columns][:, self._rows].T), lower=1.0)
        for figure, most in self._limits:
            program.keep(figure[columns], most)
        changes, unheld = np.zeros(0), np.zeros(0)
        if self._most_changes is not None:
            changes = _count_changes(program, self._covers[columns])
            program.keep(changes, self._most_changes)
        if self._least_held is not None:
            unheld = _count_held(program, self._holds[columns])
            program.keep(unheld, -self._least_held)
        return _Model(program=program, columns=columns, changes=changes, unheld=unheld)

    def _least_level(self, values: FloatArray) -> float:
        """The largest over the components of the least value (alive candidates,) that covers it."""
        covers = self._covers[self._alive].tocsc()
        spans = zip(covers.indptr[:-1].tolist(), covers.indptr[1:].tolist(), strict=True)
        return max(float(values[covers.indices[start:end]].min()) for start, end in spans)

    def _note(self, name: str, outcome: Outcome, bound: float, figures: FloatArray | None = None) -> bool:
        """Write down what is known of an objective (of a sum: its figures); whether a choice was found."""
        if outcome.values is None:
            self.detail[name] = "not reached in the time"
            if figures is not None and self.chosen is not None:
                self.detail[name] += f": {figures[self.chosen].sum():.6g} as it stands, at least {bound:.6g}"
            return False
        self.detail[name] = PROVEN if outcome.proven else f"{outcome.objective:.6g} reached in the time, at least {bound:.6g}"
        return True

    def _relaxed(self, model: _Model, objective: FloatArray, outcome: Outcome) -> float:
        """Lower bound of an objective that was reached and is not proven; otherwise nobody asks for it."""
        if outcome.proven or outcome.values is None:
            return -np.inf
        return model.program.relaxation(objective, self._deadline_s - time.monotonic())

    def _price(self, columns: IntArray, figures: FloatArray) -> None:
        """Bound of a sum by its relaxation, and the prices that prove it."""
        limits = [(figure[columns], most) for figure, most in self._limits]
        found = prices(self._covers[columns][:, self._rows], figures[columns], limits)
        self.prices = np.zeros(self._covers.shape[1])
        self.bound, self.prices[self._rows], self._limit_prices = found

    def _discard(self, figures: FloatArray, optimum: float) -> None:
        """Leave to the next objectives the candidates that an optimum of this one may contain."""
        reduced = figures - self._covers @ self.prices
        for (figure, _), price in zip(self._limits, self._limit_prices.tolist(), strict=True):
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
