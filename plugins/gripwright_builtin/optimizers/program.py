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
class Solution:
    """Values of the variables; `proven` where the solver says that nothing is better."""

    values: FloatArray  # (variables,)
    objective: float
    proven: bool


class IntegerProgram:
    """Minimise c·v subject to lower ≤ A·v ≤ upper and 0 ≤ v ≤ limit; it grows by variables and rows."""

    def __init__(self) -> None:
        self._limits: FloatArray = np.empty(0)
        self._integer: BoolArray = np.empty(0, dtype=bool)
        self._blocks: list[scipy.sparse.csr_array] = []
        self._lower: FloatArray = np.empty(0)
        self._upper: FloatArray = np.empty(0)

    @property
    def size(self) -> int:
        """Number of variables."""
        return len(self._limits)

    def add_variables(self, count: int, *, integer: bool, limit: float = 1.0) -> slice:
        """Add `count` variables in [0, limit]; the answer is where they stand."""
        start = self.size
        self._limits = np.append(self._limits, np.full(count, limit))
        self._integer = np.append(self._integer, np.full(count, integer))
        return slice(start, start + count)

    def add_rows(self, rows: scipy.sparse.csr_array, *, lower: float = -np.inf, upper: float = np.inf) -> None:
        """Add rows (r, first variables) with the same bounds; variables beyond have the coefficient 0."""
        self._blocks.append(rows)
        self._lower = np.append(self._lower, np.full(rows.shape[0], lower))
        self._upper = np.append(self._upper, np.full(rows.shape[0], upper))

    def keep(self, objective: FloatArray, value: float) -> None:
        """Allow from now on only what is no worse than `value` in this objective."""
        self.add_rows(scipy.sparse.csr_array(objective[None, :]), upper=value + _KEPT * max(1.0, abs(value)))

    def minimise(self, objective: FloatArray, solver: Solver, time_limit_s: float) -> Solution | None:
        """The best values found in the time, None where none were found."""
        costs = np.zeros(self.size)
        costs[: len(objective)] = objective
        values, proven = (self._cbc if solver == "cbc" else self._highs)(costs, max(time_limit_s, 1.0))
        if values is None:
            return None
        values = np.where(self._integer, np.round(values), values)
        return Solution(values=values, objective=float(costs @ values), proven=proven)

    def relaxation_bound(self, objective: FloatArray) -> float:
        """Optimum when every variable may be a fraction: a lower bound; 0 where the solver gave up."""
        result = scipy.optimize.milp(objective, bounds=self._bounds(), constraints=self._constraints())
        return float(result.fun) if result.status == 0 else 0.0

    def _matrix(self) -> scipy.sparse.csr_array:
        widened = [scipy.sparse.csr_array((b.data, b.indices, b.indptr), shape=(b.shape[0], self.size)) for b in self._blocks]
        return scipy.sparse.csr_array(scipy.sparse.vstack(widened, format="csr"))

    def _bounds(self) -> scipy.optimize.Bounds:
        return scipy.optimize.Bounds(0.0, self._limits)

    def _constraints(self) -> scipy.optimize.LinearConstraint:
        return scipy.optimize.LinearConstraint(self._matrix(), self._lower, self._upper)

    def _highs(self, costs: FloatArray, time_limit_s: float) -> tuple[FloatArray | None, bool]:
        result = scipy.optimize.milp(
            costs,
            integrality=self._integer.astype(np.int64),
            bounds=self._bounds(),
            constraints=self._constraints(),
            options={"time_limit": time_limit_s, "mip_rel_gap": 0.0},
        )
        return (None if result.x is None else np.asarray(result.x)), bool(result.status == 0)

    def _cbc(self, costs: FloatArray, time_limit_s: float) -> tuple[FloatArray | None, bool]:
        variables = [
            pulp.LpVariable(f"v{i}", 0.0, limit, pulp.LpInteger if integer else pulp.LpContinuous)
            for i, (limit, integer) in enumerate(zip(self._limits.tolist(), self._integer.tolist(), strict=True))
        ]
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
        problem.solve(pulp.PULP_CBC_CMD(msg=False, timeLimit=time_limit_s, gapRel=0.0, gapAbs=0.0, threads=1))
        if problem.sol_status not in (pulp.LpSolutionOptimal, pulp.LpSolutionIntegerFeasible):
            return None, False
        values = np.array([0.0 if v.varValue is None else v.varValue for v in variables])
        # PuLP's status reads "Optimal" at a time limit too; only `sol_status` tells them apart.
        return values, bool(problem.sol_status == pulp.LpSolutionOptimal)
