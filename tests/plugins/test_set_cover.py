"""The smallest gripper set: against brute force, and on the paper's instance."""

import dataclasses
import itertools
import json
import math
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gripwright.domain.grasp import EXTERNAL, INTERNAL, GraspConstraint
from gripwright.domain.gripper import GripperParameters
from gripwright.domain.gripper_set import ComponentAlternatives, GripperClass, GripperSet, GripperSetProblem
from gripwright.plugin_api import RunContext
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer, SetCoverParams

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"
CLASSES = {
    "parallel-2": GripperClass(stroke_mm=6.0, cost=2.0),
    "centric-3": GripperClass(stroke_mm=3.0, cost=1.0, opening_floor_mm=2.0, finger_length_max_mm=7.0),
    "bore-3": GripperClass(stroke_mm=4.0, cost=3.0, grip=INTERNAL),
}

Score = tuple[float, ...]


def solve(problem: GripperSetProblem, solver: str = "highs", **figures: int) -> GripperSet:
    return SetCoverOptimizer(SetCoverParams.model_validate({"solver": solver, **figures})).solve(problem, RunContext())


def make_alternative(
    gripper_type: str, width: float, low: float, high: float = math.inf, release: float = 0.0
) -> GraspConstraint:
    return GraspConstraint(
        gripper_type=gripper_type,
        opening_width_mm=width,
        finger_length_min_mm=low,
        finger_length_max_mm=high,
        release_clearance_mm=release,
    )


def make_problem(*components: list[GraspConstraint], **figures: object) -> GripperSetProblem:
    made = tuple(ComponentAlternatives(id=str(i), alternatives=tuple(a)) for i, a in enumerate(components))
    problem = GripperSetProblem(classes=CLASSES, components=made)
    return dataclasses.replace(problem, **figures)  # type: ignore[arg-type]


@st.composite
def problems(draw: st.DrawFn) -> GripperSetProblem:
    """Small problems with many ties: figures on a coarse grid."""
    keys = draw(st.lists(st.sampled_from(sorted(CLASSES)), min_size=1, max_size=2, unique=True))
    alternative = st.builds(
        make_alternative,
        st.sampled_from(keys),
        st.integers(1, 12).map(float),
        low := st.integers(1, 8).map(float),
        st.one_of(st.just(math.inf), low),
        st.sampled_from([0.0, 0.0, 2.0]),
    )
    components = draw(st.lists(st.lists(alternative, max_size=3), min_size=1, max_size=3))
    owned = [
        GripperParameters(
            gripper_type=keys[0], opening_min_mm=w, opening_max_mm=w + 3.0, finger_length_mm=5.0, grip=CLASSES[keys[0]].grip
        )
        for w in draw(st.lists(st.integers(0, 9).map(float), max_size=1))
    ]
    return make_problem(
        *components,
        classes={key: CLASSES[key] for key in keys},
        release_clearance_mm=draw(st.sampled_from([0.0, 1.0])),
        finger_length_step_mm=draw(st.sampled_from([0.0, 0.0, 3.0])),
        owned=tuple(owned),
        in_sequence=draw(st.booleans()),
    )


@dataclasses.dataclass(frozen=True)
class Item:
    """A gripper of the brute force: what it holds, and its figures (new, cost, off step, length, reach)."""

    held: frozenset[tuple[int, int]]
    figures: tuple[float, ...]

    @property
    def components(self) -> frozenset[int]:
        return frozenset(component for component, _ in self.held)


def items_of(problem: GripperSetProblem) -> list[Item]:
    """All grippers on a grid of whole millimetres, which holds all critical values of `problems()`."""
    items = [Item(held_by(owned, problem), (0.0, 0.0, 0.0, 0.0, 0.0)) for owned in problem.owned]
    for (key, kind), opening, length in itertools.product(problem.classes.items(), range(20), range(1, 13)):
        if length > kind.finger_length_max_mm:
            continue
        floor = max(0.0, kind.opening_floor_mm)
        if kind.grip == INTERNAL:
            low, high, reach = float(opening), opening + kind.stroke_mm, -float(opening)
        else:
            low, high, reach = max(floor, opening - kind.stroke_mm), float(opening), float(opening)
        if low < floor:
            continue
        gripper = GripperParameters(
            gripper_type=key, opening_min_mm=low, opening_max_mm=high, finger_length_mm=float(length), grip=kind.grip
        )
        step = problem.finger_length_step_mm
        off_step = float(step > 0 and length % step != 0)
        items.append(Item(held_by(gripper, problem), (1.0, kind.cost, off_step, float(length), reach)))
    return list(best_of_each(items))


def held_by(gripper: GripperParameters, problem: GripperSetProblem) -> frozenset[tuple[int, int]]:
    return frozenset(
        (c, a)
        for c, component in enumerate(problem.components)
        for a, alternative in enumerate(component.alternatives)
        if gripper.satisfies(alternative, problem.release_clearance_mm)
    )


def best_of_each(items: list[Item]) -> Iterator[Item]:
    """Without those that hold nothing, or no more than another one that is no worse in any figure."""
    unique = sorted({item for item in items if item.held}, key=lambda item: (item.figures, sorted(item.held)))
    for item in unique:
        if not any(
            other is not item
            and item.held <= other.held
            and all(b <= a for a, b in zip(item.figures, other.figures, strict=True))
            and (other.held, other.figures) != (item.held, item.figures)
            for other in unique
        ):
            yield item


def changes_of(chosen: tuple[Item, ...], sequence: list[int]) -> float:
    """Fewest changes of gripper along the sequence, by dynamic programming."""
    cost = dict.fromkeys(range(len(chosen)), 0.0)
    for component in sequence:
        able = [i for i, item in enumerate(chosen) if component in item.components]
        cost = {i: min(before + (i != j) for j, before in cost.items()) for i in able}
        for i in set(range(len(chosen))) - set(able):
            cost[i] = math.inf
    return min(cost.values(), default=0.0)


def score_of(chosen: tuple[Item, ...], problem: GripperSetProblem, sequence: list[int]) -> Score:
    """The objectives in their order, the smaller the better."""
    new = [item.figures for item in chosen if item.figures[0]]
    in_sequence = (sum(f[1] for f in new), changes_of(chosen, sequence)) if problem.in_sequence else ()
    return (
        len(new),
        len(chosen) - len(new),
        *in_sequence,
        sum(f[2] for f in new),
        max((f[3] for f in new), default=0.0),
        sum(f[3] for f in new),
        0 if problem.in_sequence else -len(frozenset().union(*(item.held for item in chosen))),
        sum(f[4] for f in new),
    )


def brute_force(problem: GripperSetProblem) -> Score:
    """The best score of all sets of grippers that hold whatever can be held."""
    items = items_of(problem)
    sequence = sorted(frozenset().union(*(item.components for item in items)))
    scores = [
        score_of(chosen, problem, sequence)
        for size in range(len(sequence) + 1)
        for chosen in itertools.combinations(items, size)
        if frozenset().union(*(item.components for item in chosen)) == frozenset(sequence)
    ]
    return min(scores)


def score_of_solution(problem: GripperSetProblem, solution: GripperSet) -> Score:
    chosen = []
    for gripper in solution.grippers:
        parameters, kind = gripper.parameters, problem.classes[gripper.parameters.gripper_type]
        reach = parameters.opening_max_mm if parameters.grip == EXTERNAL else -parameters.opening_min_mm
        step, length = problem.finger_length_step_mm, parameters.finger_length_mm
        figures = (1.0, kind.cost, float(step > 0 and length % step != 0), length, reach)
        chosen.append(Item(held_by(parameters, problem), (0.0,) * 5 if gripper.owned else figures))
    coverable = [i for i, component in enumerate(problem.components) if component.id not in solution.uncoverable]
    return score_of(tuple(chosen), problem, coverable)


@settings(max_examples=500, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(problem=problems())
def test_no_set_is_better_in_any_objective(problem: GripperSetProblem) -> None:
    solution = solve(problem)

    assert solution.proven
    assert set(solution.detail.values()) <= {"proven"}
    assert score_of_solution(problem, solution) == pytest.approx(brute_force(problem))
    assert solution.lower_bound == sum(not gripper.owned for gripper in solution.grippers)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(problem=problems())
def test_both_solvers_find_sets_that_are_equally_good(problem: GripperSetProblem) -> None:
    by_cbc, by_highs = solve(problem, "cbc"), solve(problem, "highs")

    assert score_of_solution(problem, by_cbc) == pytest.approx(score_of_solution(problem, by_highs))


@pytest.mark.parametrize("seed", range(8))
def test_a_uniform_grid_never_needs_fewer_grippers(seed: int) -> None:
    rng = np.random.default_rng(seed)
    problem = make_problem(
        *(
            [
                make_alternative("parallel-2", w, low, low + 4.0)
                for w, low in rng.uniform([2.0, 5.0], [60.0, 30.0], (2, 2)).round(2)
            ]
            for _ in range(25)
        ),
        release_clearance_mm=1.0,
    )

    exact, on_grid = solve(problem, candidates_max=0), solve(problem, candidates_max=0, grid=200)

    assert (exact.proven, exact.uncoverable) == (True, ())
    assert len(exact.grippers) <= len(on_grid.grippers) + len(on_grid.uncoverable)
    for gripper in on_grid.grippers:
        for component, indices in gripper.holds.items():
            for index in indices:
                assert gripper.parameters.satisfies(problem.components[int(component)].alternatives[index], 1.0)


def test_a_coarse_grid_misses_the_optimum() -> None:
    problem = make_problem(*([make_alternative("parallel-2", width, 5.0)] for width in (10.0, 17.0, 22.5, 30.0)))

    exact, coarse = solve(problem), solve(problem, grid=4)

    assert (len(exact.grippers), len(coarse.grippers)) == (3, 4)


def test_a_sequence_too_large_for_all_objectives_says_that_cost_and_changes_are_not_weighed() -> None:
    problem = dataclasses.replace(hard_problem(), in_sequence=True)

    solution = solve(problem, candidates_max=10, time_limit=5)

    assert {name for name, detail in solution.detail.items() if detail.startswith("not weighed")} == {"cost", "tool changes"}


def paper_problem() -> GripperSetProblem:
    path = SHARED / "paper-widths.json"
    if not path.exists() and os.environ.get("CI") != "true":
        pytest.skip(f"{path} is not there")
    document = json.loads(path.read_text(encoding="utf-8"))
    return GripperSetProblem(
        classes={key: GripperClass(stroke_mm=stroke) for key, stroke in document["strokes"].items()},
        components=tuple(
            ComponentAlternatives(
                id=component["id"],
                alternatives=tuple(
                    make_alternative(a["gripper_type"], a["opening_width"], a["finger_length_min"])
                    for a in component["alternatives"]
                ),
            )
            for component in document["components"]
        ),
    )


@pytest.mark.parametrize("solver", ["cbc", "highs"])
def test_the_papers_instance_gives_the_papers_grippers(solver: str) -> None:
    golden = json.loads((Path(__file__).parents[1] / "golden" / "paper-grippers.json").read_text(encoding="utf-8"))

    solution = solve(paper_problem(), solver)

    found = [
        [p.gripper_type, p.opening_min_mm, p.opening_max_mm, p.finger_length_mm]
        for p in (g.parameters for g in solution.grippers)
    ]
    assert found == golden["grippers"]
    assert (solution.lower_bound, solution.proven) == (4, True)


def test_every_gripper_of_a_set_is_needed() -> None:
    problem = paper_problem()

    solution = solve(problem)

    for left_out in solution.grippers:
        rest = set().union(*(gripper.holds for gripper in solution.grippers if gripper is not left_out))
        assert rest != {component.id for component in problem.components}


def test_owned_grippers_are_used_before_new_ones() -> None:
    problem = paper_problem()
    owned = tuple(gripper.parameters for gripper in solve(problem).grippers[:3])

    solution = solve(dataclasses.replace(problem, owned=owned))

    assert [gripper.owned for gripper in solution.grippers] == [True, True, True, False]
    assert solution.lower_bound == 1


def test_owned_grippers_that_hold_everything_need_no_new_one_even_of_a_problem_too_large_to_optimise() -> None:
    problem = paper_problem()
    owned = tuple(gripper.parameters for gripper in solve(problem).grippers)
    optimizer = SetCoverOptimizer(SetCoverParams(candidates_max=0))

    solution = optimizer.solve(dataclasses.replace(problem, owned=owned), RunContext())

    assert all(gripper.owned for gripper in solution.grippers)
    assert (solution.uncoverable, solution.proven) == ((), True)
    assert {component for gripper in solution.grippers for component in gripper.holds} == {c.id for c in problem.components}


@pytest.mark.parametrize(("width", "grippers"), [(14.0, 1), (13.999, 2)])
def test_a_range_is_closed_at_both_ends(width: float, grippers: int) -> None:
    problem = make_problem([make_alternative("a", 22.0, 30.0)], [make_alternative("a", width, 30.0)])
    problem = dataclasses.replace(problem, classes={"a": GripperClass(stroke_mm=8.0)})

    assert len(solve(problem).grippers) == grippers


def test_figures_that_are_equal_as_decimals_fit() -> None:
    problem = make_problem([make_alternative("a", 0.3, 1.0)], [make_alternative("a", 0.1, 1.0)])
    problem = dataclasses.replace(problem, classes={"a": GripperClass(stroke_mm=0.3)}, release_clearance_mm=0.1)

    assert len(solve(problem).grippers) == 1  # 0.1 + 0.3 is less than 0.3 + 0.1 + nothing only in binary


def test_what_no_gripper_can_hold_is_listed_and_the_rest_is_solved() -> None:
    problem = make_problem(
        [],
        [make_alternative("parallel-2", 5.0, 2.0)],
        [make_alternative("centric-3", 1.0, 2.0)],  # the fingers meet
        [make_alternative("centric-3", 5.0, 8.0)],  # fingers longer than the actuator bears
        [make_alternative("parallel-2", 5.0, 2.0, release=7.0)],  # more than the stroke
        [make_alternative("unknown", 5.0, 2.0)],
    )

    solution = solve(problem)

    assert solution.uncoverable == ("0", "2", "3", "4", "5")
    assert [tuple(gripper.holds) for gripper in solution.grippers] == [("1",)]


def test_a_problem_without_components_needs_no_gripper() -> None:
    assert solve(make_problem()).grippers == ()


def test_lengths_are_rounded_up_to_the_step_where_the_upper_bound_allows() -> None:
    free, bound = make_alternative("parallel-2", 5.0, 6.5), make_alternative("parallel-2", 50.0, 6.5, 7.0)

    solution = solve(make_problem([free], [bound], finger_length_step_mm=5.0))

    assert [gripper.parameters.finger_length_mm for gripper in solution.grippers] == [10.0, 6.5]


def test_a_set_whose_number_is_not_proven_says_so() -> None:
    problem = hard_problem()
    optimizer = SetCoverOptimizer(SetCoverParams(solver="highs", time_limit=0.01, candidates_max=0))

    solution = optimizer.solve(problem, RunContext())

    assert not solution.proven
    assert solution.lower_bound < len(solution.grippers)
    assert set().union(*(gripper.holds for gripper in solution.grippers)) == {component.id for component in problem.components}


def test_a_set_too_large_for_all_objectives_is_the_smallest_and_says_what_is_not_proven() -> None:
    problem = paper_problem()
    optimizer = SetCoverOptimizer(SetCoverParams(candidates_max=10))

    solution = optimizer.solve(problem, RunContext())

    assert len(solution.grippers) == 4
    assert "not proven" in solution.detail["finger lengths"]
    assert sum(gripper.parameters.finger_length_mm for gripper in solution.grippers) == 120.0


def hard_problem() -> GripperSetProblem:
    rng = np.random.default_rng(5)
    return make_problem(
        *(
            [
                make_alternative(str(rng.choice(["parallel-2", "centric-3"])), float(w), 1.0)
                for w in rng.uniform(3, 120, 4).round(1)
            ]
            for _ in range(300)
        )
    )
