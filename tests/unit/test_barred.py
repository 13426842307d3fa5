"""What no finger bears is given up for its kind of fingers alone."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gripwright.design.barred import fingers_kind, without_barred
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, INTERNAL, FreeGrasp, Grasp, Hold, OperationVerdict, SegmentVerdict
from gripwright.domain.v_tip import Vee


def free(grip: str, force_N: float, least_mm: float = 10.0) -> FreeGrasp:
    return FreeGrasp(
        grasp=Grasp(X_CG=np.eye(4), gripper_type=CENTRIC_3, grip=grip, opening_width_mm=20.0),
        envelopes_mm=np.array([40.0]),
        finger_length_min_mm=np.array([least_mm]),
        finger_length_max_mm=np.inf,
        release_opening_mm=21.0,
        gap_mm=1.0,
        hold=Hold(required_force_N=force_N, moment_Nmm=0.0, symmetry=1.0),
    )


@pytest.mark.parametrize(
    ("limit_N", "left"),
    [
        (60.0, [(EXTERNAL, 80.0), (INTERNAL, 40.0), (INTERNAL, 50.0)]),
        (50.0, [(EXTERNAL, 80.0), (INTERNAL, 40.0)]),
        (0.0, [(EXTERNAL, 80.0)]),
    ],
)
def test_a_force_barred_for_one_grip_leaves_the_other_grip_alone(limit_N: float, left: list[tuple[str, float]]) -> None:
    grasps = (free(EXTERNAL, 80.0), free(INTERNAL, 40.0), free(INTERNAL, 50.0), free(INTERNAL, 60.0))
    segment = SegmentVerdict(segment=0, requirement=None, grasps_planned=4, free=grasps, rejection=None)
    verdict = OperationVerdict(operation="op-01", components={"ring": (segment,)}, warnings=(), timings={})

    (kept,) = without_barred(verdict, {INTERNAL: {"bending": 10.0 * limit_N, "detail": "too weak"}}).components["ring"]

    assert [(one.grasp.grip, one.hold.required_force_N) for one in kept.free] == left
    assert kept.rejection is None


@pytest.mark.parametrize("tips", [{"taper_rad": -0.1}, {"vee": Vee(angle_rad=2.0, depth_mm=3.0)}])
def test_a_force_barred_for_one_taper_or_v_leaves_other_tips_alone(tips: dict[str, Any]) -> None:
    straight, towards = free(EXTERNAL, 80.0), free(EXTERNAL, 80.0)
    tapered = replace(towards, grasp=replace(towards.grasp, **tips))
    segment = SegmentVerdict(segment=0, requirement=None, grasps_planned=2, free=(straight, tapered), rejection=None)
    verdict = OperationVerdict(operation="op-01", components={"ring": (segment,)}, warnings=(), timings={})

    for grasp, other in ((straight, tapered), (tapered, straight)):
        barred = {fingers_kind(grasp.grasp): {"bending": 100.0, "detail": "too weak"}}
        (kept,) = without_barred(verdict, barred).components["ring"]

        assert kept.free == (other,)


def test_a_greater_force_on_a_short_finger_is_kept_where_a_lesser_one_on_a_long_finger_is_not() -> None:
    long, short, shortest = free(EXTERNAL, 250.0, 80.0), free(EXTERNAL, 300.0, 10.0), free(EXTERNAL, 300.0, 0.0)
    segment = SegmentVerdict(segment=0, requirement=None, grasps_planned=3, free=(long, short, shortest), rejection=None)
    verdict = OperationVerdict(operation="op-01", components={"plate": (segment,)}, warnings=(), timings={})

    (kept,) = without_barred(verdict, {EXTERNAL: {"bending": 20_000.0, "detail": "too weak"}}).components["plate"]

    assert [grasp.bending_Nmm for grasp in (long, short, shortest)] == [20_000.0, 3_000.0, 1_500.0]
    assert kept.free == (short, shortest)


def test_nothing_barred_changes_nothing() -> None:
    verdict = OperationVerdict(operation="op-01", components={}, warnings=(), timings={})

    assert without_barred(verdict, {}) is verdict


def test_a_segment_whose_every_grasp_is_too_heavy_says_what_it_loads_the_fingers_with() -> None:
    grasp = replace(free(EXTERNAL, 812.4), hold=Hold(required_force_N=812.4, moment_Nmm=15_300.0, symmetry=1.0))
    segment = SegmentVerdict(segment=3, requirement=None, grasps_planned=1, free=(grasp,), rejection=None)
    verdict = OperationVerdict(operation="op-01", components={"ring": (segment,)}, warnings=(), timings={})

    (kept,) = without_barred(verdict, {EXTERNAL: {"bending": 5000.0, "detail": "406 N would bend it"}}).components["ring"]

    assert kept.rejection is not None
    assert kept.rejection.detail == (
        "gripped on Ø20.0 mm (segment 3), it takes a grip force of 812 N to hold it by friction against a moment of 15.3 N·m, "
        "and no finger was found that bears it: 406 N would bend it"
    )
