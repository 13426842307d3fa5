"""Which gripper of the set does which operation, and with which grasp."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gripwright.design.actuation import ActuatorClass, HoldPolicy, Shortfall
from gripwright.domain.grasp import SURFACE, FreeGrasp, Hold, OperationVerdict
from gripwright.domain.gripper import GripperParameters, Handle
from gripwright.domain.preference import weight

_BELOW = 0.3  # sine of the angle from which a hand counts as coming from below
_LEAST_N = 1e-3  # smaller forces do not differ


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldGrasp:
    """A free grasp with what it holds."""

    component: str
    segment: int
    free: FreeGrasp


def free_grasps(verdict: OperationVerdict) -> list[HeldGrasp]:
    """All free grasps of an operation, in the order of its components and segments."""
    return [
        HeldGrasp(component=component, segment=segment.segment, free=free)
        for component, segments in verdict.components.items()
        for segment in segments
        for free in segment.free
    ]


def fewest_changes(capable: Mapping[str, frozenset[int]]) -> dict[str, int]:
    """One of the capable grippers for each operation, in sequence, with the fewest changes.

    A gripper is kept as long as one that did all operations since the last change can do the next: keeping the
    intersection is optimal for a given set.
    """
    assigned: dict[str, int] = {}
    run: list[str] = []
    common: frozenset[int] = frozenset()
    for operation, able in capable.items():
        if run and not common & able:
            assigned.update(dict.fromkeys(run, min(common)))
            run = []
        common = common & able if run else able
        run.append(operation)
    if run:
        assigned.update(dict.fromkeys(run, min(common)))
    return assigned


def best_handle(
    operation: str,
    grasps: Sequence[HeldGrasp],
    parameters: GripperParameters,
    kind: ActuatorClass,
    release_clearance_mm: float,
    policy: HoldPolicy,
) -> Handle:
    """The best of the grasps that the gripper holds, by `_preference`."""
    able = [
        held for held in grasps if kind.serves(held.free) and _holds(parameters, kind, held.free, release_clearance_mm, policy)
    ]
    best = min(able, key=_preference)  # a gripper is asked only for what the optimum says that it holds
    force_N = policy.grip_force_N(kind.actuator, best.free.grasp.opening_width_mm)
    return Handle(
        operation=operation,
        component=best.component,
        segment=best.segment,
        opening_width_mm=best.free.grasp.opening_width_mm,
        release_opening_mm=best.free.release_opening_mm,
        grasp=best.free.grasp,
        gap_mm=best.free.gap_mm,
        hold=best.free.hold,
        safety_factor=safety_factor(force_N, best.free.hold),
        grip_force_N=force_N if kind.grip == SURFACE else None,
        preferences=best.free.preferences,
        bending_Nmm=best.free.bending_Nmm,
    )


def _holds(
    parameters: GripperParameters, kind: ActuatorClass, free: FreeGrasp, release_clearance_mm: float, policy: HoldPolicy
) -> bool:
    constraint = kind.constraint(free, release_clearance_mm, policy)
    return not isinstance(constraint, Shortfall) and parameters.satisfies(constraint, release_clearance_mm)


def _preference(held: HeldGrasp) -> tuple[float, ...]:
    """What the house likes best; from above or the side before from below; the least required force, where a tenth more counts
    as the same; the more upright hand; the largest gap; the most symmetric; the largest contact. Differences below what is
    measured do not count."""
    free, hold = held.free, held.free.hold
    return (
        weight(free.preferences),
        float(free.rise > _BELOW),
        round(math.log(max(hold.required_force_N, _LEAST_N)) / math.log(1.1)),
        round(free.rise, 1),
        -round(free.gap_mm, 3),
        -round(hold.symmetry, 3),
        -round(hold.contact_area_mm2, 1),
    )


def safety_factor(grip_force_N: float | None, hold: Hold) -> float | None:
    """The grip force over the force that holding needs; None: not known, or nothing is needed."""
    required_N = hold.required_force_N
    return None if grip_force_N is None or required_N <= 0.0 else grip_force_N / required_N
