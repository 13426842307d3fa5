"""The nearest miss of a rejected segment: which of its grasps came closest, what it hits or lacks, and by how much.

A grasp misses by the constraint that it misses most: every check is made and measured, not the first alone. Of a segment's
grasps a sample, drawn from all stages at which they failed, is measured by the check that each failed; the best of these in
full. The figure is that of a grasp that was planned: no search goes on from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.design.gauge import FAR_OFF, Attempt, Circumstances, Finding, Gauge, Shortage
from gripwright.design.hand_check import Miss
from gripwright.design.hand_volumes import MOTION
from gripwright.domain.grasp import Grasp, GripRequirement
from gripwright.domain.shape import FloatArray

_SAMPLE = 16  # grasps measured by the check that they failed
_IN_FULL = 4  # of these measured by all checks


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
    return None if best is None else _closest(best[1], gauges[best[2]], attempts[best[2]].requirement)


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
    if not shortages:
        return FAR_OFF + 1, 0.0
    worst = max(shortages, key=_weight)
    return worst.rank, round(worst.amount, 6)


def _weight(shortage: Shortage) -> tuple[int, float]:
    return shortage.rank, shortage.amount


def _closest(finding: Finding, gauge: Gauge, requirement: GripRequirement) -> Closest:
    """The finding with the place of what it misses most."""
    worst = max(finding.shortages, key=_weight)
    intrusion = worst.intrusion
    place, point_P = None, None if intrusion is None else intrusion.point_P
    if intrusion is not None and intrusion.volume.phase == MOTION:
        first = gauge.first_place(intrusion)
        place, point_P = (None, point_P) if first is None else first
    return Closest(
        requirement=requirement,
        grasp=finding.grasp,
        finger_length_mm=finding.finger_length_mm,
        palm_radius_mm=finding.palm_radius_mm,
        shortage=worst,
        place=place,
        point_P=point_P,
    )
