"""Stage rules: which gripper holds a primitive, and how far open (paper, sections 4.1 and 4.3)."""

from collections.abc import Sequence

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import GripperRule

ANY_KIND = "*"
"""In a rule's `accepts`: primitives of every kind."""


def requirements(primitive: Primitive, rules: Sequence[GripperRule]) -> list[GripRequirement] | Rejection:
    """What the rules that accept this kind of primitive ask for, in the rules' order; `no-type` where none has an answer."""
    asked = [rule.apply(primitive) for rule in rules if rule.accepts & {primitive.kind, ANY_KIND}]
    found = [requirement for answer in asked if not isinstance(answer, Rejection) for requirement in answer]
    if found:
        return found
    refused = [answer for answer in asked if isinstance(answer, Rejection)]
    if refused:
        return Rejection(refused[0].code, "; ".join(dict.fromkeys(answer.detail for answer in refused)))
    return Rejection("no-type", f"no rule accepts a {primitive.kind}")
