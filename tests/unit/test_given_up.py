"""What is given up where no finger can be made for a gripper: at first the grasp that bends it most, then what none bears."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gripwright.design.pipeline import _given_up
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, Grasp, Hold
from gripwright.domain.gripper import Gripper, Handle
from gripwright.store.seed import seed_actuators


class Bearing:
    """A runner whose finger designer makes fingers up to a force."""

    def __init__(self, most_N: float) -> None:
        self.values: list[Any] = []
        self.most_N = most_N

    def put(self, value: Any) -> str:
        self.values.append(value)
        return str(len(self.values) - 1)

    def get(self, ref: str) -> Any:
        return self.values[int(ref)]

    def map(self, stage: str, calls: Sequence[Mapping[str, Any]]) -> list[str]:
        assert stage == "fingers"
        return [self.put(Rejection("no-finger", "") if call["required_force"] > self.most_N else "made") for call in calls]


def handle(operation: str, force_N: float, bending_Nmm: float) -> Handle:
    return Handle(
        operation=operation,
        component="part",
        segment=0,
        opening_width_mm=20.0,
        release_opening_mm=21.0,
        grasp=Grasp(X_CG=np.eye(4), gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=20.0),
        gap_mm=1.0,
        hold=Hold(required_force_N=force_N, moment_Nmm=0.0, symmetry=1.0),
        safety_factor=2.0,
        bending_Nmm=bending_Nmm,
    )


@pytest.fixture
def gripper() -> Gripper:
    actuator = next(one for one in seed_actuators() if one.gripper_type == PARALLEL_2)
    held = (handle("light", 20.0, 500.0), handle("short", 400.0, 4000.0), handle("long", 200.0, 8000.0))
    return Gripper(
        id="G1",
        gripper_type=PARALLEL_2,
        fingers=2,
        grip=EXTERNAL,
        opening_min_mm=10.0,
        opening_max_mm=30.0,
        finger_length_mm=40.0,
        actuator=actuator,
        jaw_offset_mm=0.0,
        envelope_mm=40.0,
        handles=held,
    )


@pytest.mark.parametrize("attempt", [1, 2])
def test_at_first_the_grasp_that_bends_fingers_most_is_given_up(gripper: Gripper, attempt: int) -> None:
    assert _given_up(gripper, attempt, Bearing(0.0)) == {"long": 8000.0}


@pytest.mark.parametrize(("most_N", "share"), [(399.0, 1.0), (150.0, 0.5), (60.0, 0.25), (0.0, 0.0625)])
def test_then_all_that_bends_more_than_the_least_part_of_the_force_that_is_not_borne(
    gripper: Gripper, most_N: float, share: float
) -> None:
    assert _given_up(gripper, 3, Bearing(most_N)) == {"long": share * 8000.0}


def test_at_last_the_operation_is_given_up_and_the_others_of_the_gripper_only_where_such_fingers_bear_nothing(
    gripper: Gripper,
) -> None:
    assert _given_up(gripper, 6, Bearing(150.0)) == {"long": 0.0}
    assert _given_up(gripper, 6, Bearing(0.0)) == {"light": 0.0, "short": 0.0, "long": 0.0}


def test_a_gripper_of_one_operation_loses_that_one(gripper: Gripper) -> None:
    alone = replace(gripper, handles=gripper.handles[:1])

    assert _given_up(alone, 7, Bearing(10.0)) == {"light": 0.0}
