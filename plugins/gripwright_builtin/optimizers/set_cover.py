"""The smallest gripper set as a covering problem, solved exactly (paper, section 5.4)."""

import time
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.gripper_set import ChosenGripper, GripperSet, GripperSetProblem
from gripwright.domain.shape import IntArray
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.optimizers.candidates import (
    Candidates,
    Demands,
    candidates_at_most,
    candidates_of,
    demands_of,
    held_by_owned,
)
from gripwright_builtin.optimizers.fewest import NAME, Fewest, components_held, fewest
from gripwright_builtin.optimizers.objectives import LexicographicCover
from gripwright_builtin.optimizers.program import Solver
from gripwright_builtin.optimizers.shortening import shortened


class SetCoverParams(Params):
    """Parameters of the set-cover optimiser."""

    solver: Solver = Field("cbc", description="'cbc' (PuLP) or 'highs' (SciPy)")
    candidates_max: int = Field(
        100_000, ge=0, le=1_000_000, description="with more candidates only the number of grippers is proven smallest"
    )
    time_limit: float = Field(60.0, gt=0, le=3600, description="s, for all objectives together")


class SetCoverOptimizer:
    """Fewest grippers by integer programming over candidates at the critical values, which lose nothing.

    Owned grippers count nothing; of the sets with the fewest new ones those that use the fewest owned ones are preferred.
    """

    key: ClassVar[str] = "set_cover"
    params_model: ClassVar[type[Params]] = SetCoverParams

    def __init__(self, params: SetCoverParams) -> None:
        self._params = params

    def solve(self, problem: GripperSetProblem, ctx: RunContext) -> GripperSet:
        """The smallest set, with its lower bound; `proven` only where the solver says so."""
        deadline_s = time.monotonic() + self._params.time_limit
        demands = demands_of(problem)
        owned = held_by_owned(problem).any(axis=0)
        coverable = np.unique(demands.component[(demands.class_of >= 0) | owned])
        covered = np.isin(np.arange(len(problem.components)), coverable)
        needed = np.setdiff1d(coverable, demands.component[owned])
        ctx.progress(0.1, "fewest grippers")
        smallest = fewest(problem, demands, needed, self._params.solver, deadline_s)
        ctx.progress(0.5, "best of the smallest sets")
        candidates, chosen, detail = self._best(problem, demands, coverable, smallest, deadline_s)
        return GripperSet(
            grippers=_grippers(problem, candidates, demands, chosen),
            lower_bound=smallest.lower_bound,
            proven=smallest.proven,
            candidates=len(candidates.new),
            uncoverable=tuple(component.id for i, component in enumerate(problem.components) if not covered[i]),
            detail={NAME: smallest.detail, **detail},
        )

    def _best(
        self, problem: GripperSetProblem, demands: Demands, coverable: IntArray, smallest: Fewest, deadline_s: float
    ) -> tuple[Candidates, IntArray, dict[str, str]]:
        """The best of the smallest sets: candidates, which of them are chosen, and what is known of each objective."""
        if not len(coverable):
            return candidates_of(problem, demands), np.empty(0, dtype=np.int64), {}
        size = candidates_at_most(demands)
        if size <= self._params.candidates_max:
            candidates = candidates_of(problem, demands)
            cover = LexicographicCover(candidates.covers[:, coverable], candidates.holds, self._params.solver, deadline_s)
            cover.limit(candidates.new, len(smallest.grippers), smallest.prices[coverable], smallest.bound)
            _prefer(cover, candidates, in_sequence=problem.in_sequence)
            if cover.chosen is not None:
                return candidates, cover.chosen, cover.detail
        ranges = frozenset((gripper.gripper_type, gripper.opening_max_mm) for gripper in smallest.grippers)
        near = candidates_of(problem, demands, ranges=ranges)
        held = np.zeros((len(smallest.grippers), len(problem.components)), dtype=np.bool_)
        for g, gripper in enumerate(smallest.grippers):
            held[g] = components_held(gripper, problem, demands)
        reason = f"shortened one by one, not proven: {size} candidates are more than {self._params.candidates_max}"
        return near, shortened(near, smallest.grippers, held), {"finger lengths": reason}


def _prefer(cover: LexicographicCover, candidates: Candidates, *, in_sequence: bool) -> None:
    """The objectives after the fewest grippers, in their order."""
    if not candidates.new.all():
        cover.least_sum("owned grippers", 1.0 - candidates.new)
    if in_sequence:
        cover.least_sum("cost", candidates.cost)
        cover.fewest_changes("tool changes")
    if candidates.off_step.any():
        cover.least_sum("finger lengths off the step", candidates.off_step)
    cover.least_maximum("longest finger", candidates.length_mm)
    cover.least_sum("finger lengths", candidates.length_mm)
    if not in_sequence:
        cover.most_held("alternatives held")
    cover.least_sum("opening ranges", candidates.reach_mm)


def _grippers(problem: GripperSetProblem, candidates: Candidates, demands: Demands, which: IntArray) -> tuple[ChosenGripper, ...]:
    grippers = []
    for i in which.tolist():
        holds: dict[str, tuple[int, ...]] = {}
        for a in np.sort(candidates.holds[[i]].indices).tolist():
            component = problem.components[demands.component[a]].id
            holds[component] = (*holds.get(component, ()), int(demands.alternative[a]))
        grippers.append(ChosenGripper(parameters=candidates.parameters[i], holds=holds, owned=not candidates.new[i]))
    return tuple(sorted(grippers, key=_order))


def _order(gripper: ChosenGripper) -> tuple[str, float, float]:
    return gripper.parameters.gripper_type, gripper.parameters.opening_max_mm, gripper.parameters.finger_length_mm
