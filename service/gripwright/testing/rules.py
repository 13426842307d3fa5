"""Checks of gripper rules: requirements that a planner can use."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, INTERNAL, SURFACE, GripRequirement
from gripwright.testing.primitives import sample_primitives, widths_mm
from gripwright.testing.trial import OWN_SAMPLES, Case, Check, Trial, is_length, is_vectors


def cases(trial: Trial) -> list[Case]:
    """One a primitive that the rule accepts, of the built-in samples and of the author's own."""
    own = {f"own sample {number}, {primitive.kind}": primitive for number, primitive in enumerate(trial.own_primitives)}
    return [
        Case(name=name, method="apply", arguments={"fit": primitive})
        for name, primitive in {**sample_primitives(), **own}.items()
        if trial.plugin.accepts & {primitive.kind, "*"}
    ]


def accepts(trial: Trial) -> Iterable[str]:
    """A rule that accepts nothing is never asked, and one that asks for nothing is not looked at."""
    if not trial.plugin.accepts:
        yield "accepts is empty, so the rule is never asked"
    elif refused := trial.refused_own("sample primitives", "a requirement"):
        yield refused
    elif not any(trial.answers()):
        kinds = ", ".join(sorted(trial.plugin.accepts))
        yield (
            f"accepts {kinds}: none of {len(trial.runs)} sample primitives of that kind is answered with a requirement, so there "
            f"is nothing to look at; give primitives that it holds: {OWN_SAMPLES}"
        )


def requirements(trial: Trial) -> Iterable[str]:
    """One requirement or more, each possible, else a Rejection with a reason."""
    for run in trial.runs:
        faults = _answer_faults(run.answer, trial.plugin.key, widths_mm(run.case.arguments["fit"]))
        yield from (f"{run.case.name}: {fault}" for fault in faults)


def named(trial: Trial) -> Iterable[str]:
    """The manifest names the class of what is held, so that results can hold it."""
    asked = [item for _, answer in trial.answers() if isinstance(answer, Sequence) for item in answer]
    held = (item.primitive for item in asked if isinstance(item, GripRequirement))
    return (f"apply asks to hold {fault}" for fault in trial.unnamed(held))


def _answer_faults(answer: Any, key: str, widths: tuple[float, float]) -> Iterable[str]:
    if isinstance(answer, Rejection):
        if not (answer.code and answer.detail):
            yield "a Rejection needs a code and a sentence"
        return
    if not isinstance(answer, Sequence) or not all(isinstance(item, GripRequirement) for item in answer):
        yield f"apply returns {type(answer).__name__}, neither a sequence of GripRequirement nor a Rejection"
        return
    if not answer:
        yield "apply returns no requirement; a no is a Rejection with its reason"
    for requirement in answer:
        yield from _requirement_faults(requirement, key, widths)


def _requirement_faults(requirement: GripRequirement, key: str, widths: tuple[float, float]) -> Iterable[str]:
    width = requirement.opening_width_mm
    least, most = widths
    if not is_length(width) or not least <= width <= most:
        yield f"opening_width_mm is {width} for a primitive of at most {most:.3g} mm; lengths are mm"
    if not requirement.gripper_type:
        yield "gripper_type is empty"
    if requirement.grip not in (EXTERNAL, INTERNAL, SURFACE):
        yield f"grip is {requirement.grip!r}, not {EXTERNAL!r}, {INTERNAL!r} or {SURFACE!r}"
    for name in ("approach_C", "grip_axes_C"):
        if not is_vectors(getattr(requirement, name), unit=True):
            yield f"{name} must be unit vectors (k, 3), is {np.shape(getattr(requirement, name))}"
    if requirement.rule != key:
        yield f"rule is {requirement.rule!r}, the key is {key!r}"


CHECKS = (
    Check("accepts", "a rule accepts some kind of primitive, and asks for something", accepts),
    Check("requirements", "requirements are possible and in mm", requirements),
    Check("named", "the manifest names the class of what is held", named),
)
