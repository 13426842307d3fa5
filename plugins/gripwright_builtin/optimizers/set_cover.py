"""The smallest gripper set as a covering problem, solved exactly (paper, section 5.4)."""

import time
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.gripper_set import ChosenGripper, GripperSet, GripperSetProblem
from gripwright.domain.shape import IntArray
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.optimizers.candidates import (
    Candidates,
    CriticalRange,
    Demands,
    candidates_of,
    critical_ranges,
    demands_of,
    held_by,
    held_by_owned,
    parameters_at,
)
from gripwright_builtin.optimizers.fewest import NAME, Fewest, components_held, fewest
from gripwright_builtin.optimizers.grid import on_grid
from gripwright_builtin.optimizers.objectives import LexicographicCover
from gripwright_builtin.optimizers.program import Solver
from gripwright_builtin.optimizers.shortening import shortened
from gripwright_builtin.optimizers.trimming import lengths_within, without_dear, without_idle

COST, CHANGES = "cost", "tool changes"


class SetCoverParams(Params):
    """Parameters of the set-cover optimiser."""

    solver: Solver = Field("cbc", description="'cbc' (PuLP) or 'highs' (SciPy)")
    candidates_max: int = Field(
        100_000, ge=0, le=1_000_000, description="with more candidates only the number of grippers is proven smallest"
    )
    grid: int = Field(
        0, ge=0, le=1000, description="the paper's way, for comparison: so many even openings and finger lengths; 0: exact"
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
        if self._params.grid:
            demands = on_grid(demands, self._params.grid)
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
        ranges = self._ranges(problem, demands, smallest)
        if ranges is not None:
            candidates = candidates_of(problem, demands, ranges=ranges)
            cover = LexicographicCover(candidates.covers[:, coverable], candidates.holds, self._params.solver, deadline_s)
            cover.limit(candidates.new, len(smallest.grippers), smallest.prices[coverable], smallest.bound)
            _prefer(cover, candidates, in_sequence=problem.in_sequence)
            if cover.chosen is not None:
                return candidates, cover.chosen, cover.detail
        chosen = frozenset((gripper.gripper_type, gripper.opening_max_mm) for gripper in smallest.grippers)
        reason = "none is found in the time" if ranges is not None else f"more than {self._params.candidates_max} candidates"
        near = candidates_of(problem, demands, ranges=_like(chosen, problem, demands))
        held = np.zeros((len(smallest.grippers), len(problem.components)), dtype=np.bool_)
        for g, gripper in enumerate(smallest.grippers):
            held[g] = components_held(gripper, problem, demands)
        detail = {name: f"not weighed: {reason}" for name in (COST, CHANGES) if problem.in_sequence}
        detail["finger lengths"] = f"shortened one by one, not proven: {reason}"
        return near, shortened(near, smallest.grippers, held), detail

    def _ranges(self, problem: GripperSetProblem, demands: Demands, smallest: Fewest) -> list[CriticalRange] | None:
        """The opening ranges that a best set may contain; None where they make too many candidates."""
        ranges = without_dear(critical_ranges(problem, demands), demands, smallest.prices, smallest.bound, len(smallest.grippers))
        if problem.in_sequence:  # else the alternatives held are an objective
            ranges = without_idle(ranges, demands)
        return lengths_within(ranges, demands, self._params.candidates_max)


def _prefer(cover: LexicographicCover, candidates: Candidates, *, in_sequence: bool) -> None:
    """The objectives after the fewest grippers, in their order."""
    if not candidates.new.all():
        cover.least_sum("owned grippers", 1.0 - candidates.new)
    if in_sequence:
        cover.least_sum(COST, candidates.cost)
        cover.fewest_changes(CHANGES)
    if candidates.off_step.any():
        cover.least_sum("finger lengths off the step", candidates.off_step)
    cover.least_maximum("longest finger", candidates.length_mm)
    cover.least_sum("finger lengths", candidates.length_mm)
    if not in_sequence:
        cover.most_held("alternatives held")
    cover.least_sum("opening ranges", candidates.reach_mm)


def _like(chosen: frozenset[tuple[str, float]], problem: GripperSetProblem, demands: Demands) -> Iterator[CriticalRange]:
    """The opening ranges, as pairs of class and largest opening, that are among these."""
    for one in critical_ranges(problem, demands):
        if (one.key, parameters_at(one.key, problem.classes[one.key], one.reach_mm, 0.0).opening_max_mm) in chosen:
            yield one


def _grippers(problem: GripperSetProblem, candidates: Candidates, demands: Demands, which: IntArray) -> tuple[ChosenGripper, ...]:
    grippers = []
    for i in which.tolist():
        parameters, is_new = candidates.parameters[i], bool(candidates.new[i])
        held = np.flatnonzero(held_by(parameters, problem, demands)) if is_new else np.sort(candidates.holds[[i]].indices)
        holds: dict[str, tuple[int, ...]] = {}
        for a in held.tolist():
            component = problem.components[demands.component[a]].id
            holds[component] = (*holds.get(component, ()), int(demands.alternative[a]))
        grippers.append(ChosenGripper(parameters=parameters, holds=holds, owned=not is_new))
    return tuple(sorted(grippers, key=_order))


def _order(gripper: ChosenGripper) -> tuple[str, float, float]:
    return gripper.parameters.gripper_type, gripper.parameters.opening_max_mm, gripper.parameters.finger_length_mm
