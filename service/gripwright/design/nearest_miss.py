"""The nearest miss of a rejected segment: which of its grasps came closest, what it hits or lacks, and by how much.

Every check is made and measured, not the first alone that fails; the closest grasp is that of which the fingers and the palm lack
least, each by its worst, added up. What is told of it is the part that lacks most. Of a segment's
grasps a sample, drawn from all stages at which they failed, is measured by the check that each failed; the best of these in
full. The figure is that of a grasp that was planned: no search goes on from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.design.gauge import FAR_OFF, HOLDING, Attempt, Circumstances, Finding, Gauge, Shortage
from gripwright.design.hand_check import Miss
from gripwright.design.hand_volumes import CLOSING, LEAVING, MOTION, OPENING, TAKING_UP
from gripwright.domain.grasp import Grasp, GripRequirement
from gripwright.domain.shape import FloatArray

_SAMPLE = 32  # grasps measured by the check that they failed
_IN_FULL = 6  # of these measured by all checks
_SAME_MM = 0.01
PHASES = (TAKING_UP, CLOSING, MOTION, OPENING, LEAVING, HOLDING)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Closest:
    """The grasp that came closest, and what it misses most."""

    requirement: GripRequirement
    grasp: Grasp
    finger_length_mm: float
    palm_radius_mm: float | None
    shortage: Shortage
    place: float | None
    point_P: FloatArray | None


def closest_grasp(attempts: Sequence[Attempt], around: Circumstances) -> Closest | None:
    """The grasp that came closest, of all attempts; None where none was planned."""
    gauges = [Gauge(attempt, around) for attempt in attempts]
    sample = _sampled([(k, miss) for k, attempt in enumerate(attempts) for miss in attempt.missed])
    glances = [(_key(gauges[k].at_its_stage(miss)), k, miss) for k, miss in sample]
    glances.sort(key=lambda entry: entry[0])  # stable: of equal ones the planner's first
    best: tuple[tuple[int, float], Finding, int] | None = None
    for glance, k, miss in glances[:_IN_FULL]:
        if best is not None and glance >= best[0]:
            break  # a grasp misses by at least what the check says that it failed
        assert miss.grasp is not None
        finding = gauges[k].in_full(miss.grasp)
        key = _key(finding.shortages)
        if finding.shortages and (best is None or key < best[0]):
            best = key, finding, k
    return (
        None
        if best is None
        else _closest(best[1], gauges[best[2]], attempts[best[2]].requirement, around.scene.release_clearance_mm)
    )


def _sampled(missed: Sequence[tuple[int, Miss]]) -> list[tuple[int, Miss]]:
    """Up to `_SAMPLE` of the misses: from each stage evenly, most from the last one that was reached."""
    stages = sorted({miss.stage for _, miss in missed}, reverse=True)
    chosen: list[tuple[int, Miss]] = []
    for number, stage in enumerate(stages):
        at_stage = [entry for entry in missed if entry[1].stage == stage]
        count = min(len(at_stage), -(-(_SAMPLE - len(chosen)) // (2 if number < len(stages) - 1 else 1)))
        chosen += [at_stage[i] for i in np.unique(np.linspace(0, len(at_stage) - 1, count).astype(int))]
    return chosen


def _key(shortages: Sequence[Shortage]) -> tuple[int, float]:
    """How far a grasp is from one that holds: what each part of the gripper lacks at the most, added up."""
    if not shortages:
        return FAR_OFF + 1, 0.0
    lacking: dict[str | None, float] = {}
    for shortage in shortages:
        lacking[shortage.part] = max(shortage.amount, lacking.get(shortage.part, 0.0))
    return max(shortage.rank for shortage in shortages), round(sum(lacking.values()), 6)


def _weight(shortage: Shortage) -> tuple[int, float]:
    return shortage.rank, shortage.amount


def _told(shortages: Sequence[Shortage], release_clearance_mm: float) -> Shortage:
    """What is told of a grasp: the part that lacks most, in the first phase in which it does, but for the opening's share."""
    worst = max(shortages, key=_weight)
    least = worst.amount - release_clearance_mm / 2.0 - _SAME_MM
    alike = [one for one in shortages if (one.rank, one.part, one.hit) == (worst.rank, worst.part, worst.hit)]
    return min((one for one in alike if one.amount >= least), key=lambda one: (PHASES.index(one.phase), -one.amount))


def _closest(finding: Finding, gauge: Gauge, requirement: GripRequirement, release_clearance_mm: float) -> Closest:
    """The finding with the place of what it misses most."""
    told = _told(finding.shortages, release_clearance_mm)
    intrusion = told.intrusion
    place, point_P = None, None if intrusion is None else intrusion.point_P
    if intrusion is not None and intrusion.volume.phase == MOTION:
        first = gauge.first_place(intrusion)
        place, point_P = (None, point_P) if first is None else first
    return Closest(
        requirement=requirement,
        grasp=finding.grasp,
        finger_length_mm=finding.finger_length_mm,
        palm_radius_mm=finding.palm_radius_mm,
        shortage=told,
        place=place,
        point_P=point_P,
    )
