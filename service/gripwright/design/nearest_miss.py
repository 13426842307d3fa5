"""The nearest miss of a rejected segment: which of its grasps came closest, what it hits or lacks, and by how much.

Every check is made and measured, not the first alone that fails; the closest grasp is that of which the fingers and the palm lack
least, each by its worst, added up. What is told of it is the part that lacks most. Of a segment's
grasps a sample, drawn from all stages at which they failed, is measured by the check that each failed; the best of these in
full, and with them some that failed late. The figure is that of a grasp that was planned: no search goes on from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.design.gauge import FAR_OFF, HOLDING, MEASURED, PLACED, Attempt, Circumstances, Finding, Gauge, Shortage
from gripwright.design.hand_check import Miss
from gripwright.design.hand_volumes import CLOSING, LEAVING, MOTION, OPENING, TAKING_UP
from gripwright.domain.grasp import Grasp, GripRequirement
from gripwright.domain.shape import FloatArray

_SAMPLE = 16  # grasps of one requirement measured by the check that they failed
_IN_FULL = 3  # of these measured by all checks
_CLEARLY = 0.8  # of what a requirement's grasp lacks, for one of a later requirement to count as closer
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
    """The grasp that came closest, of all attempts; None where none was planned.

    An earlier attempt, of a requirement that comes first, counts as closest where a later one is not clearly closer.
    """
    best: _Candidate | None = None
    for attempt in attempts:
        gauge = Gauge(attempt, around)
        candidate = _best(attempt, gauge)
        if candidate is not None and (best is None or _clearly_closer(candidate.key, best.key)):
            best = candidate
    return None if best is None else _closest(best, around.scene.release_clearance_mm)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Candidate:
    """The closest grasp of one attempt."""

    key: tuple[int, float]
    finding: Finding
    gauge: Gauge
    requirement: GripRequirement


def _clearly_closer(one: tuple[int, float], other: tuple[int, float]) -> bool:
    return one[0] < other[0] or (one[0] == other[0] and one[1] < _CLEARLY * other[1])


def _best(attempt: Attempt, gauge: Gauge) -> _Candidate | None:
    """Of a sample of one attempt the grasp that lacks least."""
    early = _sampled([miss for miss in attempt.missed if miss.stage < PLACED], _SAMPLE)
    late = _sampled([miss for miss in attempt.missed if miss.stage >= PLACED], _IN_FULL)
    glances = sorted(((_key(gauge.glance(miss)), miss) for miss in early), key=lambda entry: entry[0])  # stable: planner's order
    chosen = [*(((MEASURED, 0.0), miss) for miss in late), *glances[:_IN_FULL]]
    best: _Candidate | None = None
    for glance, miss in chosen:
        if best is not None and glance >= best.key:
            break  # a grasp lacks at least what the check says that it failed
        assert miss.grasp is not None
        finding = gauge.in_full(miss.grasp)
        key = _key(finding.shortages)
        if finding.shortages and (best is None or key < best.key):
            best = _Candidate(key=key, finding=finding, gauge=gauge, requirement=attempt.requirement)
    return best


def _sampled(missed: Sequence[Miss], most: int) -> list[Miss]:
    """Up to `most` of the misses: from each stage evenly, most from the last one that was reached."""
    stages = sorted({miss.stage for miss in missed}, reverse=True)
    chosen: list[Miss] = []
    for number, stage in enumerate(stages):
        at_stage = [miss for miss in missed if miss.stage == stage]
        count = min(len(at_stage), -(-(most - len(chosen)) // (2 if number < len(stages) - 1 else 1)))
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


def _closest(candidate: _Candidate, release_clearance_mm: float) -> Closest:
    """The candidate with the place of what is told of it."""
    finding = candidate.finding
    told = _told(finding.shortages, release_clearance_mm)
    place, point_P = None, None if told.intrusion is None else told.intrusion.point_P
    if told.intrusion is not None and told.phase == MOTION:
        first = candidate.gauge.first_place(told.intrusion)
        place, point_P = (None, point_P) if first is None else first
    return Closest(
        requirement=candidate.requirement,
        grasp=finding.grasp,
        finger_length_mm=finding.finger_length_mm,
        palm_radius_mm=finding.palm_radius_mm,
        shortage=told,
        place=place,
        point_P=point_P,
    )
