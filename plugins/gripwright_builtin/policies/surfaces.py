"""Surfaces that a house does not grip, though the method would."""

from collections.abc import Mapping
from typing import ClassVar

from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement
from gripwright.domain.gripper import Actuator
from gripwright.domain.preference import INDIFFERENT, Preference
from gripwright.domain.shape import Segment
from gripwright.plugin_api import Params


class NeverGripParams(Params):
    """What is not gripped."""

    marks: tuple[str, ...] = Field(
        (), description="Words in the reason of a mark, or of what was detected, such as 'ground'; in any case of letters."
    )
    share_min: float = Field(
        0.01, gt=0, le=1, description="Share of a segment's area from which such a mark forbids all of it; below, it is avoided."
    )
    primitives: tuple[str, ...] = Field((), description="Kinds of primitives that are not gripped, such as 'cylinder'.")
    area_min: float = Field(0.0, ge=0, le=1e8, description="mm², smaller segments are not gripped.")


class NeverGrip:
    """Never grip segments with certain marks, of certain primitives, or too small."""

    key: ClassVar[str] = "never_grip"
    params_model: ClassVar[type[NeverGripParams]] = NeverGripParams

    def __init__(self, params: NeverGripParams) -> None:
        self._params = params

    def grip(
        self, component: Component, segment: Segment, requirement: GripRequirement, marks: Mapping[str, float]
    ) -> Rejection | Preference:
        """`marked-surface`, `primitive-not-allowed` or `too-small`; a factor above 1 for little of a mark."""
        p = self._params
        if requirement.primitive.kind in p.primitives:
            return Rejection("primitive-not-allowed", f"a {requirement.primitive.kind} is not gripped")
        if segment.area_mm2 < p.area_min:
            return Rejection("too-small", f"the segment has {segment.area_mm2:.1f} mm², at least {p.area_min:g} mm² are needed")
        named = {
            reason: share for reason, share in marks.items() if any(word.casefold() in reason.casefold() for word in p.marks)
        }
        share = sum(named.values())
        if share <= 0.0:
            return INDIFFERENT
        found = f"{', '.join(sorted(named))}: {100 * share:.2g} % of the segment"
        if share < p.share_min:
            return Preference(factor=1.0 + share, detail=found)
        return Rejection("marked-surface", f"{found}, less than {100 * p.share_min:g} % may be marked so")

    def actuator(self, actuator: Actuator) -> Rejection | Preference:
        """Actuators are all the same to it."""
        return INDIFFERENT
