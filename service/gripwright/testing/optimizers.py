"""Checks of gripper-set optimizers: what a solution claims, it does."""

from collections.abc import Iterable

from gripwright.domain.grasp import CENTRIC_3, PARALLEL_2, SURFACE, GraspConstraint
from gripwright.domain.gripper_set import ChosenGripper, ComponentAlternatives, GripperClass, GripperSet, GripperSetProblem
from gripwright.testing.trial import Case, Check, Trial

_CLASSES = {
    PARALLEL_2: GripperClass(stroke_mm=6.0, cost=2.0, finger_length_max_mm=60.0),
    CENTRIC_3: GripperClass(stroke_mm=4.0, cost=1.0, opening_floor_mm=2.0, finger_length_max_mm=60.0),
    "face-1": GripperClass(stroke_mm=0.0, grip=SURFACE, cost=1.0, finger_length_max_mm=60.0),
}
_FEWEST = {
    "one component": 1,
    "near and far widths": 2,
    "two types": 2,
    "an alternative saves a gripper": 1,
    "a face of each size": 2,
}
"""Name → the fewest grippers, by hand."""


def cases(trial: Trial) -> list[Case]:
    """Problems small enough to be solved by hand."""
    a, b = (PARALLEL_2, 20.0), (PARALLEL_2, 23.0)
    problems = {
        "one component": _problem([a]),
        "near and far widths": _problem([a], [b], [(PARALLEL_2, 40.0)]),
        "two types": _problem([a], [(CENTRIC_3, 20.0)], [b]),
        "an alternative saves a gripper": _problem([(CENTRIC_3, 50.0), a], [b]),
        "a face of each size": _problem([("face-1", 20.0)], [("face-1", 30.0)], [("face-1", 20.0)]),
    }
    return [Case(name=name, method="solve", arguments={"problem": problem}) for name, problem in problems.items()]


def _problem(*components: list[tuple[str, float]]) -> GripperSetProblem:
    """Alternatives (type, width) of each component, fingers of 20 mm or more."""
    return GripperSetProblem(
        classes=_CLASSES,
        release_clearance_mm=1.0,
        components=tuple(
            ComponentAlternatives(
                id=f"component-{number}",
                alternatives=tuple(
                    GraspConstraint(
                        gripper_type=gripper_type, opening_width_mm=width, finger_length_min_mm=20.0, finger_length_max_mm=50.0
                    )
                    for gripper_type, width in alternatives
                ),
            )
            for number, alternatives in enumerate(components, 1)
        ),
    )


def covers(trial: Trial) -> Iterable[str]:
    """Every component is held by a gripper that can hold it; all of these problems can be solved."""
    for case, solution in trial.answers():
        if not isinstance(solution, GripperSet):
            yield f"{case.name}: solve returns {type(solution).__name__}, not a GripperSet"
            continue
        problem = case.arguments["problem"]
        for gripper in solution.grippers:
            yield from (f"{case.name}: {fault}" for fault in _gripper_faults(gripper, problem))
        held = {component for gripper in solution.grippers for component, indices in gripper.holds.items() if indices}
        for component in problem.components:
            if component.id not in held:
                yield f"{case.name}: no gripper holds {component.id}, which can be held"


def _gripper_faults(gripper: ChosenGripper, problem: GripperSetProblem) -> Iterable[str]:
    parameters, slack = gripper.parameters, 1e-9
    limits = problem.classes.get(parameters.gripper_type)
    if limits is None:
        yield f"a gripper is of the class {parameters.gripper_type!r}, which the problem does not have"
        return
    stroke = parameters.opening_max_mm - parameters.opening_min_mm
    if stroke > limits.stroke_mm + slack or stroke < 0:
        yield f"a gripper's opening changes by {stroke:g} mm, the stroke of {parameters.gripper_type} is {limits.stroke_mm:g} mm"
    if parameters.opening_min_mm < limits.opening_floor_mm - slack or parameters.finger_length_mm > limits.finger_length_max_mm:
        yield "a gripper exceeds the limits of its class"
    alternatives = {component.id: component.alternatives for component in problem.components}
    for component, indices in gripper.holds.items():
        for index in indices:
            if component not in alternatives or not 0 <= index < len(alternatives[component]):
                yield f"a gripper claims alternative {index} of {component}, which does not exist"
            elif not parameters.satisfies(alternatives[component][index], problem.release_clearance_mm):
                yield f"a gripper claims to hold {component} by alternative {index}, and cannot"


def bound(trial: Trial) -> Iterable[str]:
    """The lower bound is one; what is proven is the fewest."""
    for case, solution in trial.answers():
        count, fewest = len(solution.grippers), _FEWEST[case.name]
        if not count >= solution.lower_bound:
            yield f"{case.name}: {count} grippers are fewer than the lower bound of {solution.lower_bound}"
        if solution.lower_bound > fewest:
            yield f"{case.name}: the lower bound is {solution.lower_bound}, {fewest} suffice"
        if solution.proven and count != fewest:
            yield f"{case.name}: {count} grippers are called proven, {fewest} suffice"


CHECKS = (
    Check("covers", "every component that can be held is held, by a gripper that can", covers),
    Check("lower bound", "no bound above the fewest grippers, nothing proven that is not", bound),
)
