"""Stage policies: what the house forbids and prefers, of grips and of actuators, whatever the method says."""

import dataclasses
from collections.abc import Sequence

from gripwright.design.stages.affordance import marked_shares
from gripwright.design.step_values import HouseActuators
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import INTERNAL, GripRequirement
from gripwright.domain.gripper import Actuator
from gripwright.domain.preference import Preference, weight
from gripwright.domain.shape import Segment
from gripwright.plugin_api import HousePolicy

Opinion = Rejection | tuple[Preference, ...]


def house_grips(
    component: Component,
    segment: Segment,
    requirements: Sequence[GripRequirement],
    forbidden: Sequence[Forbidden],
    policies: Sequence[HousePolicy],
) -> tuple[GripRequirement, ...] | Rejection:
    """The requirements of a segment that the house allows, those that it likes best first, or why it allows none."""
    if not policies:
        return tuple(requirements)
    marks = marked_shares(component.mesh, segment, forbidden)
    kept, refusals = [], []
    for requirement in requirements:
        opinion = _opinion([(policy.key, policy.grip(component, segment, requirement, marks)) for policy in policies])
        if isinstance(opinion, Rejection):
            refusals.append(opinion)
        else:
            kept.append(dataclasses.replace(requirement, preferences=opinion))
    if not kept:
        return Rejection(refusals[0].code, "; ".join(dict.fromkeys(refusal.detail for refusal in refusals)))
    return tuple(sorted(kept, key=lambda need: (weight(need.preferences), need.grip == INTERNAL)))


def house_actuators(actuators: Sequence[Actuator], policies: Sequence[HousePolicy]) -> HouseActuators:
    """What the house says of each actuator."""
    opinions = {actuator: _opinion([(policy.key, policy.actuator(actuator)) for policy in policies]) for actuator in actuators}
    return HouseActuators(
        allowed=tuple(actuator for actuator, opinion in opinions.items() if not isinstance(opinion, Rejection)),
        refused=tuple((actuator, opinion) for actuator, opinion in opinions.items() if isinstance(opinion, Rejection)),
        preferences={actuator.name: opinion for actuator, opinion in opinions.items() if not isinstance(opinion, Rejection)},
    )


def _opinion(answers: Sequence[tuple[str, Rejection | Preference]]) -> Opinion:
    """Of the answers by policy the first veto, or all preferences; each names its policy."""
    for key, answer in answers:
        if isinstance(answer, Rejection):
            return Rejection(answer.code, f"policy {key}: {answer.detail}")
    return tuple(
        dataclasses.replace(answer, policy=key)
        for key, answer in answers
        if isinstance(answer, Preference) and answer.factor != 1.0
    )
