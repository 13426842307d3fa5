"""Stage rules: which gripper holds a primitive, and how far open (paper, sections 4.1 and 4.3)."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import GripperRule

ANY_KIND = "*"
"""In a rule's `accepts`: primitives of every kind."""

_MOST_TOLD = 8
"""Refusals that a reason has room for."""


class _Refusal(NamedTuple):
    """Who says no to what, and why."""

    who: str
    rejection: Rejection


def requirements(primitives: Sequence[Primitive], rules: Sequence[GripperRule]) -> list[GripRequirement] | Rejection:
    """What the rules ask for the primitives of a segment, each by those that accept its kind, in the order of both.

    Where there is none, `no-type` with every refusal, each once; several by the name of the rule and the primitive.
    """
    answers = [answer for primitive in primitives for answer in _asked(primitive, rules)]
    refused = [answer for answer in answers if isinstance(answer, _Refusal)]
    found = [requirement for answer in answers if not isinstance(answer, _Refusal) for requirement in answer]
    return _told(refused) if refused and not found else found


def _asked(primitive: Primitive, rules: Sequence[GripperRule]) -> Iterator[Sequence[GripRequirement] | _Refusal]:
    accepting = [rule for rule in rules if rule.accepts & {primitive.kind, ANY_KIND}]
    if not accepting:
        yield _Refusal("", Rejection("no-type", f"no rule accepts a {primitive.kind}"))
    for rule in accepting:
        answer = rule.apply(primitive) or Rejection("no-type", "asks for nothing, and does not say why")
        yield _Refusal(f"{rule.key} on the {primitive.kind}", answer) if isinstance(answer, Rejection) else answer


def _told(refused: Sequence[_Refusal]) -> Rejection:
    """All refusals as one; who says the same is named together."""
    said: dict[str, list[str]] = {}
    for refusal in refused:
        said.setdefault(refusal.rejection.detail, []).append(refusal.who)
    told = [f"{' and '.join(filter(None, dict.fromkeys(who)))}: {detail}".removeprefix(": ") for detail, who in said.items()]
    if len(told) == 1:
        told = list(said)
    elif len(told) > _MOST_TOLD:
        told = [*told[:_MOST_TOLD], f"{len(told) - _MOST_TOLD} more refusals"]
    return Rejection(refused[0].rejection.code, "; ".join(told))
