"""Integer programs in matrix form, solved by CBC (through PuLP) or HiGHS (through SciPy)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pulp
import scipy.optimize
import scipy.sparse

from gripwright.domain.shape import BoolArray, FloatArray

Solver = Literal["cbc", "highs"]

_KEPT = 1e-7  # slack, relative, of the row that keeps an earlier objective at its optimum


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """What a solver found: values (None: none found) and whether it says that nothing is better (or that nothing exists)."""

    values: FloatArray | None  # (variables,)
    objective: float
    proven: bool


class IntegerProgram:
    """Minimise c·v subject to lower ≤ A·v ≤ upper and 0 ≤ v ≤ 1; it grows by variables and rows."""

    def __init__(self) -> None:
        self._integer: BoolArray = np.empty(0, dtype=bool)
        self._blocks: list[scipy.sparse.csr_array] = []
        self._lower: FloatArray = np.empty(0)
        self._upper: FloatArray = np.empty(0)

    @property
    def size(self) -> int:
        """Number of variables."""
        return len(self._integer)

    def add_variables(self, count: int, *, integer: bool) -> int:
        """Add `count` variables in [0, 1]; the answer is the index of the first one."""
        start = self.size
        self._integer = np.append(self._integer, np.full(count, integer))
        return start

    def add_rows(self, rows: scipy.sparse.csr_array, *, lower: float = -np.inf, upper: float = np.inf) -> None:
        """Add rows (r, first variables) with the same bounds; variables beyond have the coefficient 0."""
        self._blocks.append(rows)
        self._lower = np.append(self._lower, np.full(rows.shape[0], lower))
        self._upper = np.append(self._upper, np.full(rows.shape[0], upper))

    def keep(self, objective: FloatArray, most: float) -> None:
        """Allow only what is no worse than `most` in this objective (its first variables)."""
        self.add_rows(scipy.sparse.csr_array(objective[None, :]), upper=most + _KEPT * max(1.0, abs(most)))

    def minimise(self, objective: FloatArray, solver: Solver, time_limit_s: float) -> Outcome:
        """The best values found in the time."""
        costs = np.zeros(self.size)
        costs[: len(objective)] = objective
        values, proven = (self._cbc if solver == "cbc" else self._highs)(costs, max(time_limit_s, 1.0))
        if values is None:
            return Outcome(values=None, objective=np.inf, proven=proven)
        values = np.where(self._integer, np.round(values), values)
        return Outcome(values=values, objective=float(costs @ values), proven=proven)

    def relaxation(self, objective: FloatArray, time_limit_s: float) -> float:
        """Optimum when every variable may be a fraction: a lower bound; −inf where the time did not suffice."""
        costs = np.zeros(self.size)
        costs[: len(objective)] = objective
        result = scipy.optimize.milp(
            costs,
            bounds=scipy.optimize.Bounds(0.0, 1.0),
            constraints=self._constraints(),
            options={"time_limit": max(time_limit_s, 1.0)},
        )
        return float(result.fun) if result.status == 0 else -np.inf

    def _matrix(self) -> scipy.sparse.csr_array:
        widened = [scipy.sparse.csr_array((b.data, b.indices, b.indptr), shape=(b.shape[0], self.size)) for b in self._blocks]
        return scipy.sparse.csr_array(scipy.sparse.vstack(widened, format="csr"))

    def _constraints(self) -> scipy.optimize.LinearConstraint:
        return scipy.optimize.LinearConstraint(self._matrix(), self._lower, self._upper)

    def _highs(self, costs: FloatArray, time_limit_s: float) -> tuple[FloatArray | None, bool]:
        result = scipy.optimize.milp(
            costs,
            integrality=self._integer.astype(np.int64),
            bounds=scipy.optimize.Bounds(0.0, 1.0),
            constraints=self._constraints(),
            options={"time_limit": time_limit_s, "mip_rel_gap": 0.0},
        )
        optimal, infeasible = 0, 2
        return (None if result.x is None else np.asarray(result.x)), bool(result.status in (optimal, infeasible))

    def _cbc(self, costs: FloatArray, time_limit_s: float) -> tuple[FloatArray | None, bool]:
        problem, variables = self._pulp(costs)
        problem.solve(pulp.PULP_CBC_CMD(msg=False, timeLimit=time_limit_s, gapRel=0.0, gapAbs=0.0, threads=1))
        if problem.sol_status not in (pulp.LpSolutionOptimal, pulp.LpSolutionIntegerFeasible):
            return None, bool(problem.status == pulp.LpStatusInfeasible)
        values = np.array([0.0 if v.varValue is None else v.varValue for v in variables])
        # PuLP's status reads "Optimal" at a time limit too; only `sol_status` tells them apart.
        return values, bool(problem.sol_status == pulp.LpSolutionOptimal)

    def _pulp(self, costs: FloatArray) -> tuple[pulp.LpProblem, list[pulp.LpVariable]]:
        kinds = [pulp.LpInteger if integer else pulp.LpContinuous for integer in self._integer.tolist()]
        variables = [pulp.LpVariable(f"v{i}", 0.0, 1.0, kind) for i, kind in enumerate(kinds)]
        problem = pulp.LpProblem("gripper_set", pulp.LpMinimize)
        problem.setObjective(pulp.LpAffineExpression([(v, c) for v, c in zip(variables, costs.tolist(), strict=True) if c]))
        matrix = self._matrix()
        indices, data = matrix.indices.tolist(), matrix.data.astype(np.float64).tolist()
        for row, (start, end) in enumerate(zip(matrix.indptr[:-1].tolist(), matrix.indptr[1:].tolist(), strict=True)):
            terms = pulp.LpAffineExpression([(variables[indices[t]], data[t]) for t in range(start, end)])
            if np.isfinite(self._lower[row]):
                problem += pulp.LpConstraint(terms, pulp.LpConstraintGE, f"low{row}", float(self._lower[row]))
            if np.isfinite(self._upper[row]):
                problem += pulp.LpConstraint(terms, pulp.LpConstraintLE, f"high{row}", float(self._upper[row]))
        return problem, variables
