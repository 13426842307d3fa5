"""The fewest grippers of a problem of any size: solved on few components, which grow until the optimum holds all."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from gripwright.domain.gripper import GripperParameters
from gripwright.domain.gripper_set import GripperSetProblem
from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright_builtin.optimizers.candidates import Demands, candidates_of, held_by, parameters_at
from gripwright_builtin.optimizers.objectives import PROVEN, LexicographicCover
from gripwright_builtin.optimizers.program import Solver
from gripwright_builtin.optimizers.reduction import greedy_cover

NAME = "grippers"

_FIRST = 150  # components that it begins with
_MORE = 0.4  # components added at a time, of those already there
_TRIALS = 6  # reaches, and finger lengths, that a gripper is moved to


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fewest:
    """A smallest set of new grippers for the components needed."""

    grippers: tuple[GripperParameters, ...]
    bound: float  # by relaxation
    prices: FloatArray  # (components,) dual prices that prove the bound
    detail: str  # "proven", or how far it may be off

    @property
    def proven(self) -> bool:
        """Whether fewer are impossible."""
        return self.detail == PROVEN

    @property
    def lower_bound(self) -> int:
        """Fewer than these are impossible."""
        return len(self.grippers) if self.proven else math.ceil(self.bound - 1e-6)


def fewest(problem: GripperSetProblem, demands: Demands, needed: IntArray, solver: Solver, deadline_s: float) -> Fewest:
    """The fewest new grippers that hold the components `needed` (indices).

    Fewer components never need more grippers: once an optimum for some of them holds all, it is an optimum for all.
    """
    if not len(needed):
        return Fewest(grippers=(), bound=0.0, prices=np.zeros(len(problem.components)), detail=PROVEN)
    choices = np.bincount(demands.component[demands.class_of >= 0], minlength=len(problem.components))
    without_owned = dataclasses.replace(problem, owned=())
    hardest_first = needed[np.argsort(choices[needed], kind="stable")]
    active = hardest_first[:_FIRST]
    while True:
        part = _part(demands, active)
        candidates = candidates_of(without_owned, part, widest_only=True)
        covers = candidates.covers[:, active]
        cover = LexicographicCover(covers, candidates.holds, solver, deadline_s)
        cover.least_sum(NAME, candidates.new)
        solved = cover.chosen if cover.chosen is not None else greedy_cover(covers)
        grippers = [candidates.parameters[i] for i in solved]
        if len(active) < len(needed):
            grippers = [_moved(gripper, part, problem, demands) for gripper in grippers]
        missing = hardest_first[~_covered(grippers, problem, demands)[hardest_first]]
        if not len(missing) or cover.detail[NAME] != PROVEN:
            prices = np.zeros(len(problem.components))
            prices[active] = cover.prices
            whole = _completed(grippers, missing, problem, demands)
            return Fewest(grippers=whole, bound=cover.bound, prices=prices, detail=cover.detail[NAME])
        active = np.concatenate([active, missing[: math.ceil(_MORE * len(active))]])


def _completed(
    grippers: list[GripperParameters], missing: IntArray, problem: GripperSetProblem, demands: Demands
) -> tuple[GripperParameters, ...]:
    """The grippers, and some more for what they do not hold."""
    without_owned = dataclasses.replace(problem, owned=())
    while len(missing):
        some = missing[:_FIRST]
        part = _part(demands, some)
        candidates = candidates_of(without_owned, part, widest_only=True)
        more = [candidates.parameters[i] for i in greedy_cover(candidates.covers[:, some])]
        grippers = grippers + [_moved(gripper, part, problem, demands) for gripper in more]
        missing = missing[~_covered(grippers, problem, demands)[missing]]
    return tuple(grippers)


def _moved(gripper: GripperParameters, part: Demands, problem: GripperSetProblem, demands: Demands) -> GripperParameters:
    """A gripper that holds all that this one holds of a part of the problem, and as much as may be of the whole."""
    kept = held_by(gripper, problem, part)
    same = demands.class_of == list(problem.classes).index(gripper.gripper_type)
    reaches = _spread(demands.reach_min_mm[same], part.reach_min_mm[kept].max(), part.reach_max_mm[kept].min())
    lengths = _spread(demands.length_min_mm[same], part.length_min_mm[kept].max(), part.length_max_mm[kept].min())
    rivals = [
        parameters_at(gripper.gripper_type, problem.classes[gripper.gripper_type], reach, length)
        for reach in reaches
        for length in lengths
    ]
    return max([gripper, *rivals], key=lambda rival: int(components_held(rival, problem, demands).sum()))


def _spread(values: FloatArray, low: float, high: float) -> list[float]:
    """Some of the values between two bounds, evenly spread over their ranks."""
    within = np.unique(values[(values >= low) & (values <= high)])
    return within[np.unique(np.linspace(0, len(within) - 1, _TRIALS).astype(np.int64))].tolist() if len(within) else []


def _part(demands: Demands, components: IntArray) -> Demands:
    """The alternatives of some components."""
    rows = np.isin(demands.component, components)
    return Demands(**{field.name: getattr(demands, field.name)[rows] for field in dataclasses.fields(demands)})


def _covered(grippers: list[GripperParameters], problem: GripperSetProblem, demands: Demands) -> BoolArray:
    """(components,) whether some of the grippers holds it."""
    covered = np.zeros(len(problem.components), dtype=bool)
    for gripper in grippers:
        covered |= components_held(gripper, problem, demands)
    return covered


def components_held(gripper: GripperParameters, problem: GripperSetProblem, demands: Demands) -> BoolArray:
    """(components,) whether the gripper holds it."""
    held = demands.component[held_by(gripper, problem, demands)]
    return np.asarray(np.bincount(held, minlength=len(problem.components)) > 0)
