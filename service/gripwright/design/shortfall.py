"""Why an operation is covered by no gripper: one sentence from the constraint that came closest to being met."""

from collections.abc import Iterable, Mapping, Sequence

from gripwright.design.actuation import Shortfall
from gripwright.domain.grasp import OperationVerdict, SegmentVerdict

_ORDER = ("no-grasp", "no-type", "too-wide", "collision", "no-contact", "not-held")
"""Constraints in the order in which they are tried; what fails a later one came closer. Codes of plug-ins stand between."""

_ACTUATOR_ORDER = ("stroke-too-short", "too-wide", "too-narrow", "finger-too-long", "not-held")


def without_grasp(verdict: OperationVerdict) -> str:
    """Why nothing holds: the segment that came closest, of the components that may be held."""
    failed = [
        (component, segment, segment.rejection)
        for component, segments in verdict.components.items()
        for segment in segments
        if segment.rejection is not None
    ]
    if not failed:
        return f"no segment of {_listed(verdict.components)} was found to hold"
    component, segment, rejection = max(failed, key=lambda entry: (_rank(entry[2].code, _ORDER), entry[1].grasps_planned))
    return (
        f"none of the {len(failed)} segments of {_listed(verdict.components)} can be held; "
        f"closest came segment {segment.segment} of {component} ({rejection.code}): {rejection.detail}"
    )


def without_actuator(gripper_types: Iterable[str], shortfalls: Sequence[Shortfall]) -> str:
    """Why no actuator serves an operation whose component could be held."""
    if not shortfalls:
        return f"no actuator at hand is of type {' or '.join(sorted(set(gripper_types)))}"
    closest = min(shortfalls, key=lambda short: (-_rank(short.code, _ACTUATOR_ORDER), short.amount, short.detail))
    return f"its free grasps are served by no actuator; closest came ({closest.code}): {closest.detail}"


def _rank(code: str, order: Sequence[str]) -> float:
    return order.index(code) if code in order else len(order) / 2.0


def _listed(components: Mapping[str, tuple[SegmentVerdict, ...]]) -> str:
    return " and ".join(components)
