"""Errors on their way from one process to another as JSON, with what decides how they are answered."""

from collections.abc import Callable, Mapping
from typing import Any

from gripwright.domain.errors import Cancelled, Fault, GripwrightError
from gripwright.jobs.child import Refused
from gripwright.jobs.engine import DeadlineExceeded, PassingFailure, may_heal, problem_of

Told = dict[str, Any]
"""A problem (see `problem_of`), and beside it whether it may heal and the key of the step it arose in."""


def told(error: GripwrightError) -> Told:
    """An error as JSON."""
    return {**problem_of(error), "heals": may_heal(error), "step": error.context.get("step")}


def error_of(problem: Mapping[str, Any]) -> GripwrightError:
    """The error that was told."""
    detail, faults = problem["detail"], tuple(Fault(**fault) for fault in problem["errors"])
    context = {"stage": problem["stage"], "plugin": problem["plugin"], "step": problem["step"]}
    if problem["code"] == Cancelled.code:
        return Cancelled(detail)
    if problem["code"] == DeadlineExceeded.code:
        return DeadlineExceeded(detail, **context)
    if problem["heals"] and problem["code"] == PassingFailure.code:
        return PassingFailure(detail, faults=faults, **context)
    return Refused(problem["code"], detail, faults, **context)


def outcome(function: Callable[[], Any]) -> dict[str, Any]:
    """What a function returned or raised, as JSON; what is no GripwrightError is raised."""
    try:
        return {"value": function()}
    except GripwrightError as error:
        return {"problem": told(error)}


def value_of(recorded: Mapping[str, Any]) -> Any:
    """What the function returned, or raises what it raised."""
    if "problem" in recorded:
        raise error_of(recorded["problem"])
    return recorded["value"]
