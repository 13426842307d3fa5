"""Why an operation is covered by no gripper: one sentence from the constraint that came closest to being met."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from gripwright.design.actuation import Shortfall
from gripwright.domain.grasp import NearestMiss, OperationVerdict, SegmentVerdict

_ORDER = ("no-grasp", "no-type", "too-wide", "collision", "no-contact", "not-held")
"""Constraints in the order in which they are tried; what fails a later one came closer. Codes of plug-ins stand between."""

_ACTUATOR_ORDER = ("stroke-too-short", "too-wide", "too-narrow", "finger-too-long", "not-held")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosestSegment:
    """The segment of an operation's components that came closest to being held."""

    component: str
    segment: int
    miss: NearestMiss


def closest_segment(verdict: OperationVerdict) -> ClosestSegment | None:
    """The segment whose nearest miss is nearest; None where some grasp holds, and where no miss was measured."""
    segments = [(name, segment) for name, judged in verdict.components.items() for segment in judged]
    if any(segment.free for _, segment in segments):
        return None
    measured = [
        ClosestSegment(component=name, segment=segment.segment, miss=segment.nearest_miss)
        for name, segment in segments
        if segment.nearest_miss is not None
    ]
    return min(measured, key=lambda entry: _distance(entry.miss), default=None)


def _distance(miss: NearestMiss) -> tuple[int, float]:
    """How far a miss is: first what only lacks force or friction, then by millimetres, last what holds nothing at all."""
    if miss.code == "not-held":
        return 0, miss.amount or 0.0
    nothing = miss.quantity in ("contact height", "opening") and not miss.found
    return 2 if nothing else 1, miss.amount or 0.0


def without_grasp(verdict: OperationVerdict) -> str:
    """Why nothing holds: the grasp that came closest, of the components that may be held."""
    judged = [(component, segment) for component, segments in verdict.components.items() for segment in segments]
    failed = [(component, segment, segment.rejection) for component, segment in judged if segment.rejection is not None]
    if not failed:
        return f"{_unheld(verdict)}: no segment was found to grip"
    closest = closest_segment(verdict)
    if closest is not None:
        planned = sum(segment.grasps_planned for _, segment in judged)
        searched = sorted({f", {segment.searched}" for _, segment in judged if segment.searched})
        among = f"that is the closest found of {planned} grasps on {_segments(len(judged))}{''.join(searched)}"
        return f"{_unheld(verdict)}: {_subject(closest, verdict)}{closest.miss.sentence}; {among}"
    component, segment, rejection = max(failed, key=lambda entry: (_rank(entry[2].code, _ORDER), entry[1].grasps_planned))
    return (
        f"{_unheld(verdict)}: no grasp can be planned on {_segments(len(failed))}; "
        f"closest came segment {segment.segment} of {component} ({rejection.code}): {rejection.detail}"
    )


def _unheld(verdict: OperationVerdict) -> str:
    return f"{_listed(verdict.components)} cannot be held in {verdict.operation}"


def _subject(closest: ClosestSegment, verdict: OperationVerdict) -> str:
    return "" if len(verdict.components) == 1 else f"{closest.component}, "


def _segments(count: int) -> str:
    return "its one segment" if count == 1 else f"{count} segments"


def without_actuator(verdict: OperationVerdict, gripper_types: Iterable[str], shortfalls: Collection[Shortfall]) -> str:
    """Why no actuator serves an operation whose component could be held."""
    if not shortfalls:
        return f"{_unheld(verdict)}: no actuator at hand is of type {' or '.join(sorted(set(gripper_types)))}"
    short = closest(shortfalls)
    return f"{_unheld(verdict)}: its free grasps are served by no actuator; closest came ({short.code}): {short.detail}"


def closest(shortfalls: Iterable[Shortfall]) -> Shortfall:
    """The shortfall that comes closest to none."""
    return min(shortfalls, key=lambda short: (-_rank(short.code, _ACTUATOR_ORDER), short.amount, short.detail))


def _rank(code: str, order: Sequence[str]) -> float:
    return order.index(code) if code in order else len(order) / 2.0


def _listed(components: Mapping[str, tuple[SegmentVerdict, ...]]) -> str:
    return " and ".join(components)
