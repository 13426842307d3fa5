"""The gripper-set problem as JSON (INTERFACE.md): the body of `gripwright minimise` and of `POST /gripper-sets`."""

import math
import re
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gripwright.domain.errors import Fault, InvalidInput
from gripwright.domain.grasp import GraspConstraint
from gripwright.domain.gripper import GripperParameters
from gripwright.domain.gripper_set import ChosenGripper, ComponentAlternatives, GripperClass, GripperSet, GripperSetProblem
from gripwright.plugin_api import GripperOptimizer, RunContext

_FINGERS = re.compile(r"-([1-9][0-9]?)$")
_DECIMALS = 9  # of W⁻, a difference: 33.3 − 8 is 25.3
_LENGTH_MAX_MM = 1e6  # what is larger is no length

Length = Annotated[float, Field(ge=0, le=_LENGTH_MAX_MM)]
Identifier = Annotated[str, Field(min_length=1, max_length=200)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class Alternative(_Model):
    """One way to hold a component; lengths in mm, `finger_length_max` null: unbounded."""

    gripper_type: Identifier
    opening_width: Length
    finger_length_min: Length
    finger_length_max: Length | None = None


class ConstrainedComponent(_Model):
    """A component and all ways to hold it."""

    id: Identifier
    alternatives: list[Alternative]


class OwnedGripper(_Model):
    """A gripper that is at hand already: it counts nothing."""

    gripper_type: Identifier
    opening_min: Length
    opening_max: Length
    finger_length: Length


class Constraints(_Model):
    """The gripper-set problem: strokes of the gripper types, and the components to hold."""

    strokes: dict[Identifier, Annotated[float, Field(gt=0, le=_LENGTH_MAX_MM)]]
    release_clearance: Length = 0.0
    finger_length_step: Length = 0.0
    components: list[ConstrainedComponent]
    owned: list[OwnedGripper] = []


def minimise(document: object, optimizer: GripperOptimizer, ctx: RunContext | None = None) -> dict[str, Any]:
    """The answer to a document of constraints, as JSON; InvalidInput names every fault by its pointer."""
    constraints = parse(document)
    return answer(optimizer.solve(problem_of(constraints), ctx or RunContext()))


def parse(document: object) -> Constraints:
    """The checked document."""
    try:
        constraints = Constraints.model_validate(document)
    except ValidationError as error:
        faults = tuple(Fault(pointer=_pointer(fault["loc"]), message=fault["msg"]) for fault in error.errors())
        raise InvalidInput("the constraints are not a gripper-set problem", faults=faults) from None
    contradictions = tuple(_contradictions(constraints))
    if contradictions:
        raise InvalidInput("the constraints are not a gripper-set problem", faults=contradictions)
    return constraints


def problem_of(constraints: Constraints) -> GripperSetProblem:
    """The problem that an optimiser solves."""
    return GripperSetProblem(
        classes={key: GripperClass(stroke_mm=stroke) for key, stroke in constraints.strokes.items()},
        components=tuple(
            ComponentAlternatives(id=component.id, alternatives=tuple(_constraint(a) for a in component.alternatives))
            for component in constraints.components
        ),
        release_clearance_mm=constraints.release_clearance,
        finger_length_step_mm=constraints.finger_length_step,
        owned=tuple(
            GripperParameters(
                gripper_type=owned.gripper_type,
                opening_min_mm=owned.opening_min,
                opening_max_mm=owned.opening_max,
                finger_length_mm=owned.finger_length,
            )
            for owned in constraints.owned
        ),
    )


def answer(solution: GripperSet) -> dict[str, Any]:
    """The solution as JSON; `new` counts the grippers that are not owned, `objectives` says what is proven of each."""
    return {
        "grippers": [_gripper(gripper) for gripper in solution.grippers],
        "lower_bound": solution.lower_bound,
        "proven": solution.proven,
        "uncoverable": list(solution.uncoverable),
        "new": sum(not gripper.owned for gripper in solution.grippers),
        "candidates": solution.candidates,
        "objectives": dict(solution.detail),
    }


def fingers_of(gripper_type: str) -> int | None:
    """Number of fingers: the number at the end of a gripper type, as in centric-3; None where there is none."""
    match = _FINGERS.search(gripper_type)
    return int(match.group(1)) if match else None


def _gripper(gripper: ChosenGripper) -> dict[str, Any]:
    parameters = gripper.parameters
    return {
        "gripper_type": parameters.gripper_type,
        "fingers": fingers_of(parameters.gripper_type),
        "opening_min": round(parameters.opening_min_mm, _DECIMALS),
        "opening_max": parameters.opening_max_mm,
        "finger_length": parameters.finger_length_mm,
        "components": list(gripper.holds),
        "owned": gripper.owned,
    }


def _constraint(alternative: Alternative) -> GraspConstraint:
    length_max = alternative.finger_length_max
    return GraspConstraint(
        gripper_type=alternative.gripper_type,
        opening_width_mm=alternative.opening_width,
        finger_length_min_mm=alternative.finger_length_min,
        finger_length_max_mm=math.inf if length_max is None else length_max,
    )


def _contradictions(constraints: Constraints) -> list[Fault]:
    faults = [
        Fault(
            pointer=_pointer(("strokes", key)),
            message=f"{key!r} does not end with its number of fingers, as centric-3 does",
        )
        for key in constraints.strokes
        if fingers_of(key) is None
    ]
    seen: set[str] = set()
    for c, component in enumerate(constraints.components):
        if component.id in seen:
            faults.append(Fault(pointer=_pointer(("components", c, "id")), message=f"the id {component.id!r} stands twice"))
        seen.add(component.id)
        for a, alternative in enumerate(component.alternatives):
            place = ("components", c, "alternatives", a)
            if alternative.gripper_type not in constraints.strokes:
                message = f"strokes has no gripper type {alternative.gripper_type!r}"
                faults.append(Fault(pointer=_pointer((*place, "gripper_type")), message=message))
            low, high = alternative.finger_length_min, alternative.finger_length_max
            if high is not None and high < low:
                message = f"finger_length_max {high:g} is less than finger_length_min {low:g}"
                faults.append(Fault(pointer=_pointer((*place, "finger_length_max")), message=message))
    for g, owned in enumerate(constraints.owned):
        if owned.gripper_type not in constraints.strokes:
            message = f"strokes has no gripper type {owned.gripper_type!r}"
            faults.append(Fault(pointer=_pointer(("owned", g, "gripper_type")), message=message))
        if owned.opening_max < owned.opening_min:
            message = f"opening_max {owned.opening_max:g} is less than opening_min {owned.opening_min:g}"
            faults.append(Fault(pointer=_pointer(("owned", g, "opening_max")), message=message))
    return faults


def _pointer(parts: tuple[int | str, ...]) -> str:
    """A JSON pointer (RFC 6901)."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in parts)
