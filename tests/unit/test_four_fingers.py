"""A centric gripper of four fingers, as a plan asks for it, in a whole design of a square bar and a disc."""

from typing import Any

import numpy as np
import pytest

from gripwright.design import pipeline
from gripwright.design.plan import plan_of
from gripwright.design.result import DesignResult
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.assembly import AssemblyTask, Component, Operation
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4
from gripwright.domain.gripper import Actuator
from gripwright.geometry import brep
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from here_runner import HereRunner

FOUR = Actuator(
    maker="M", model="four", gripper_type=CENTRIC_4, stroke_mm=10.0, grip_force_N=200.0, opening_max_mm=40.0, mass_kg=0.4
)
THREE = Actuator(
    maker="M", model="three", gripper_type=CENTRIC_3, stroke_mm=10.0, grip_force_N=200.0, opening_max_mm=40.0, mass_kg=0.4
)
OPTIONS = {"hands": ["centric_3", "centric_4", "parallel_2"], "rules": ["four_finger_cylinder", "four_finger_box"]}


def design(**options: Any) -> DesignResult:
    """A bar of 28 × 28 × 50 and a disc of radius 15, both set down alone."""
    down = np.stack([np.eye(4)] * 2)
    down[0, 2, 3] = 100.0
    shapes = {
        "bar": brep.box((-14.0, -14.0, 0.0), (14.0, 14.0, 50.0)),
        "disc": brep.cylinder_z(0.0, 0.0, 15.0, 0.0, 20.0),
    }
    task = AssemblyTask(
        part_number="P",
        revision="A",
        name="",
        components=tuple(
            Component(id=name, mesh=brep.tessellate(shape, angle_rad=0.05), X_PC=np.eye(4), density_kg_m3=1000.0)
            for name, shape in shapes.items()
        ),
        obstacles=(),
        operations=tuple(Operation(id=f"op-{name}", active=(name,), passive=(), motion=down) for name in shapes),
    )
    plan = plan_of(options)
    runner = HereRunner(plan, build_toolbox(plan, load_registry()))
    return runner.get(pipeline.design(task, [THREE, FOUR], plan, runner))


def test_one_gripper_of_four_fingers_holds_square_and_round_and_its_cad_keeps_every_promise() -> None:
    result = design(**OPTIONS)

    assert result.document["status"] == "complete"
    (gripper,) = result.document["grippers"]
    assert (gripper["gripper_type"], gripper["fingers"], gripper["actuator"]["model"]) == (CENTRIC_4, 4, "four")
    widths = {handle["component"]: handle["opening_width"] for handle in gripper["handles"]}
    assert widths == {"bar": pytest.approx(28.0, abs=0.01), "disc": pytest.approx(30.0, abs=0.05)}
    assert all(handle["verified"] for handle in gripper["handles"])
    (cad,) = result.cads
    assert isinstance(cad, GripperCad)
    brep.single_solid(brep.read_brep(cad.finger.brep))
    made = {row.item: row.quantity for row in result.bom}
    assert (made["finger"], made["pad"], made["screw"]) == (4, 4, 8)


def test_four_fingers_are_used_where_the_plan_names_them_and_nowhere_else() -> None:
    (named, *_), by_default = design(**OPTIONS).grippers, design()

    assert named.gripper_type == CENTRIC_4
    assert CENTRIC_4 not in {gripper.gripper_type for gripper in by_default.grippers}
