"""Candidate grippers that lose nothing: opening ranges and finger lengths at the critical values of the alternatives.

An alternative of width W is held by the grippers of its class whose range lies in an interval. With the reach u = W⁺ for
an external grip, u = −W⁻ for an internal one (the ranges mirror), and s = ±1, that interval is [s·W + release clearance,
s·W + stroke]. A gripper that holds by a face counts as external; it does not close, and needs no clearance. Lowering u to the
largest lower end below it, and the finger length to the largest L⁻ below it, keeps every alternative that is held: only these
values need to be tried.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse

from gripwright.domain.grasp import EXTERNAL, INTERNAL, clearance_mm
from gripwright.domain.gripper import BOUND_TOLERANCE_MM as SLACK
from gripwright.domain.gripper import GripperParameters
from gripwright.domain.gripper_set import GripperClass, GripperSetProblem
from gripwright.domain.shape import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Demands:
    """All alternatives of a problem in one table."""

    component: IntArray  # (a,) index of the component
    alternative: IntArray  # (a,) index within the component
    class_of: IntArray  # (a,) index of the class, −1: no gripper of its class can hold it
    reach_min_mm: FloatArray  # (a,) s·W + release clearance
    reach_max_mm: FloatArray  # (a,) s·W + stroke
    length_min_mm: FloatArray  # (a,)
    length_max_mm: FloatArray  # (a,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidates:
    """Grippers to choose from; owned ones have no cost, reach or length to minimise."""

    parameters: tuple[GripperParameters, ...]  # (n,)
    holds: scipy.sparse.csr_array  # (n, a) 1 where the alternative is held, of those that its range is to hold
    covers: scipy.sparse.csr_array  # (n, components) 1 where some alternative is held
    new: FloatArray  # (n,) 1, or 0: owned
    reach_mm: FloatArray  # (n,)
    length_mm: FloatArray  # (n,)
    off_step: FloatArray  # (n,) 1: the length is not a multiple of the step
    cost: FloatArray  # (n,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CriticalRange:
    """A critical reach of one class, and the alternatives that grippers of that reach are to hold."""

    key: str
    reach_mm: float
    members: IntArray  # indices of alternatives


def demands_of(problem: GripperSetProblem) -> Demands:
    """The table of alternatives, in the order of the components."""
    keys = {key: i for i, key in enumerate(problem.classes)}
    rows = [
        (
            c,
            a,
            keys.get(x.gripper_type, -1),
            x.opening_width_mm,
            x.finger_length_min_mm,
            x.finger_length_max_mm,
            clearance_mm(_grip(problem, x.gripper_type), x.release_clearance_mm, problem.release_clearance_mm),
        )
        for c, component in enumerate(problem.components)
        for a, x in enumerate(component.alternatives)
    ]
    component, alternative, class_of, width, length_min, length_max, clearance = np.array(rows).reshape(-1, 7).T
    kinds = list(problem.classes.values()) or [GripperClass(stroke_mm=0.0)]
    kind = class_of.astype(np.int64)
    sign = np.array([-1.0 if k.grip == INTERNAL else 1.0 for k in kinds])[kind]
    stroke = np.array([k.stroke_mm for k in kinds])[kind]
    floor = np.array([max(0.0, k.opening_floor_mm) for k in kinds])[kind]
    length_max = np.minimum(length_max, np.array([k.finger_length_max_mm for k in kinds])[kind])
    closed = np.where(sign > 0, width, width - clearance)  # the opening that must not fall below the floor
    possible = (kind >= 0) & (stroke >= clearance - SLACK) & (closed >= floor - SLACK) & (length_min <= length_max + SLACK)
    return Demands(
        component=component.astype(np.int64),
        alternative=alternative.astype(np.int64),
        class_of=np.where(possible, kind, -1),
        reach_min_mm=sign * width + clearance,
        reach_max_mm=sign * width + stroke,
        length_min_mm=length_min,
        length_max_mm=length_max,
    )


def held_by(gripper: GripperParameters, problem: GripperSetProblem, demands: Demands) -> BoolArray:
    """(a,) the alternatives that a new gripper of one of the classes holds."""
    kind = problem.classes[gripper.gripper_type]
    reach = -gripper.opening_min_mm if kind.grip == INTERNAL else gripper.opening_max_mm
    length = gripper.finger_length_mm
    return np.asarray(
        (demands.class_of == list(problem.classes).index(gripper.gripper_type))
        & (demands.reach_min_mm <= reach + SLACK)
        & (reach <= demands.reach_max_mm + SLACK)
        & (demands.length_min_mm <= length + SLACK)
        & (length <= demands.length_max_mm + SLACK)
    )


def held_by_owned(problem: GripperSetProblem) -> BoolArray:
    """(owned, a) the alternatives that each owned gripper holds."""
    alternatives = [alternative for component in problem.components for alternative in component.alternatives]
    held = [[gripper.satisfies(one, problem.release_clearance_mm) for one in alternatives] for gripper in problem.owned]
    return np.array(held, dtype=bool).reshape(len(problem.owned), len(alternatives))


def critical_ranges(problem: GripperSetProblem, demands: Demands, *, widest_only: bool = False) -> Iterator[CriticalRange]:
    """Every critical reach of every class.

    With `widest_only` those whose alternatives the next one of the same class holds too are left out.
    """
    for index, key in enumerate(problem.classes):
        members = np.flatnonzero(demands.class_of == index)
        members = members[np.argsort(demands.reach_min_mm[members], kind="stable")]
        for window, reach in _windows(demands, members, widest_only=widest_only):
            yield CriticalRange(key=key, reach_mm=reach, members=window)


def candidates_of(
    problem: GripperSetProblem,
    demands: Demands,
    *,
    widest_only: bool = False,
    ranges: Iterable[CriticalRange] | None = None,
) -> Candidates:
    """Every critical reach, or those of `ranges`, with every critical finger length, and the owned grippers.

    With `widest_only` the candidates that another one of the same class outdoes in what it holds are left out, whatever
    their reach and finger length: enough for the fewest grippers.
    """
    parameters: list[GripperParameters] = []
    figures: list[tuple[float, float, float, float, float]] = []  # new, reach, length, off step, cost
    held: list[IntArray] = []
    for owned, mask in zip(problem.owned, held_by_owned(problem), strict=True):
        parameters.append(owned)
        figures.append((0.0, 0.0, 0.0, 0.0, 0.0))
        held.append(np.flatnonzero(mask))
    for one in critical_ranges(problem, demands, widest_only=widest_only) if ranges is None else ranges:
        kind, window = problem.classes[one.key], one.members
        for length, off_step in _lengths(problem, kind, demands, window, widest_only=widest_only):
            parameters.append(parameters_at(one.key, kind, one.reach_mm, length))
            figures.append((1.0, one.reach_mm, length, float(off_step), kind.cost))
            inside = (demands.length_min_mm[window] <= length + SLACK) & (length <= demands.length_max_mm[window] + SLACK)
            held.append(window[inside])
    new, reach_mm, length_mm, off_step_, cost = np.array(figures).reshape(-1, 5).T
    holds = _incidence(held, len(demands.component))
    owner = _incidence([np.array([c]) for c in demands.component], len(problem.components))  # (a, components)
    covers = scipy.sparse.csr_array(((holds @ owner) > 0).astype(np.float64))
    return Candidates(
        parameters=tuple(parameters),
        holds=holds,
        covers=covers,
        new=new,
        reach_mm=reach_mm,
        length_mm=length_mm,
        off_step=off_step_,
        cost=cost,
    )


def _windows(demands: Demands, members: IntArray, *, widest_only: bool) -> Iterator[tuple[IntArray, float]]:
    """For each critical reach of one class, the alternatives (sorted by reach) that a gripper of that reach may hold."""
    low, high = demands.reach_min_mm[members], demands.reach_max_mm[members]
    last = np.flatnonzero(np.diff(low, append=np.inf) > SLACK)  # the last of each group of equal reach
    first = np.searchsorted(np.maximum.accumulate(high), low[last] - SLACK)  # all before it end too early
    following = np.append(low[last], np.inf)[1:]
    for start, end, beyond in zip(first.tolist(), last.tolist(), following.tolist(), strict=True):
        ends = high[start : end + 1]
        within = ends >= low[end] - SLACK
        if widest_only and beyond < np.inf and (ends[within] >= beyond - SLACK).all():
            continue  # the next window holds all of this one
        yield members[start : end + 1][within], float(low[end])


def _lengths(
    problem: GripperSetProblem, kind: GripperClass, demands: Demands, window: IntArray, *, widest_only: bool
) -> Iterator[tuple[float, bool]]:
    """Critical finger lengths of a window, each with whether it is off the step."""
    exact = np.unique(demands.length_min_mm[window])
    if widest_only:
        ends = np.sort(demands.length_max_mm[window])
        next_length = np.append(exact[1:], np.inf)
        loses = np.searchsorted(ends, next_length - SLACK, side="left") > np.searchsorted(ends, exact - SLACK, side="left")
        loses[-1] = True
        exact = exact[loses]
    step = problem.finger_length_step_mm
    if step <= 0.0:
        yield from ((length, False) for length in exact.tolist())
        return
    rounded = np.ceil((exact - SLACK) / step) * step
    lengths = {length: False for length in rounded.tolist() if length <= kind.finger_length_max_mm + SLACK}
    low, high = demands.length_min_mm[window], demands.length_max_mm[window]
    for length, up in zip(exact.tolist(), rounded.tolist(), strict=True):
        if up - length > SLACK and ((low <= length + SLACK) & (high >= length - SLACK) & (high < up - SLACK)).any():
            lengths[length] = True  # rounding up would lose an alternative
    yield from sorted(lengths.items())


def parameters_at(key: str, kind: GripperClass, reach: float, length: float) -> GripperParameters:
    """The gripper of a class with that reach (W⁺, or −W⁻ for an internal grip) and finger length."""
    if kind.grip == INTERNAL:
        opening_min, opening_max = max(0.0, -reach), kind.stroke_mm - reach
    else:
        opening_min, opening_max = max(0.0, kind.opening_floor_mm, reach - kind.stroke_mm), reach
    return GripperParameters(
        gripper_type=key, opening_min_mm=opening_min, opening_max_mm=opening_max, finger_length_mm=length, grip=kind.grip
    )


def _grip(problem: GripperSetProblem, key: str) -> str:
    return problem.classes[key].grip if key in problem.classes else EXTERNAL


def _incidence(members: list[IntArray], columns: int) -> scipy.sparse.csr_array:
    indptr = np.concatenate(([0], np.cumsum([len(m) for m in members], dtype=np.int64)))
    indices = np.concatenate(members) if members else np.empty(0, dtype=np.int64)
    return scipy.sparse.csr_array((np.ones(len(indices)), indices, indptr), shape=(len(members), columns))
