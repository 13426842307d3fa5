"""Checks of house policies: an opinion on every grip and every actuator, with its reason."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, PARALLEL_2
from gripwright.domain.gripper import Actuator
from gripwright.domain.preference import Preference
from gripwright.testing.primitives import centric_requirement, parallel_requirement
from gripwright.testing.samples import sample_components
from gripwright.testing.trial import Case, Check, Trial

_MARKS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {"unmarked": {}, "hardly marked": {"ground surface": 0.005}, "marked": {"ground surface": 0.4, "thread M8": 0.1}}
)
_ACTUATORS = (
    Actuator(maker="Sample", model="S1", gripper_type=CENTRIC_3, stroke_mm=8.0),
    Actuator(maker="Other", model="O2", gripper_type=PARALLEL_2, stroke_mm=48.0, grip_force_N=90.0, mass_kg=0.4, price=310.0),
)


def cases(trial: Trial) -> list[Case]:
    """Segments with and without marks, as a centric and as a parallel gripper would hold them; two actuators."""
    asked = {"centric": centric_requirement(np.eye(4)), "parallel": parallel_requirement(np.eye(4))}
    grips = [
        Case(
            name=f"{sample.name}, segment {segment.id}, {told}, {held}",
            method="grip",
            arguments={"component": sample.component, "segment": segment, "requirement": requirement, "marks": dict(marks)},
        )
        for sample in sample_components()[:2]
        for segment in sample.segments
        for told, marks in _MARKS.items()
        for held, requirement in asked.items()
    ]
    return [*grips, *(Case(name=one.name, method="actuator", arguments={"actuator": one}) for one in _ACTUATORS)]


def opinions(trial: Trial) -> Iterable[str]:
    """A Rejection with code and sentence, or a Preference; one that weighs says why."""
    for run in trial.runs:
        answer = run.answer
        if isinstance(answer, Rejection):
            if not (answer.code and answer.detail):
                yield f"{run.case.name}: a Rejection needs a code and a sentence"
        elif not isinstance(answer, Preference):
            yield f"{run.case.name}: {run.case.method} returns {type(answer).__name__}, neither a Preference nor a Rejection"
        elif answer.factor != 1.0 and not answer.detail:
            yield f"{run.case.name}: a factor of {answer.factor:g} needs a reason"


CHECKS = (Check("opinions", "a preference or a veto, with its reason", opinions),)
