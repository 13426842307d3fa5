"""Pads and concave tips as a plan asks for them, in a whole design of one peg."""

from typing import Any

import numpy as np
import pytest

from gripwright.design import pipeline
from gripwright.design.plan import plan_of
from gripwright.design.result import DesignResult
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.assembly import AssemblyTask, Component, Operation
from gripwright.domain.errors import InvalidPlan
from gripwright.domain.grasp import CENTRIC_3
from gripwright.domain.gripper import Actuator
from gripwright.domain.pad import Pad
from gripwright.geometry import brep
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from here_runner import HereRunner

ACTUATOR = Actuator(
    maker="M", model="a", gripper_type=CENTRIC_3, stroke_mm=10.0, grip_force_N=200.0, opening_max_mm=40.0, mass_kg=0.4
)


def design(**options: Any) -> tuple[DesignResult, list[str]]:
    """A peg of radius 15, set down alone."""
    down = np.stack([np.eye(4)] * 2)
    down[0, 2, 3] = 100.0
    peg = brep.tessellate(brep.cylinder_z(0.0, 0.0, 15.0, 0.0, 60.0), angle_rad=0.05)
    task = AssemblyTask(
        part_number="P",
        revision="A",
        name="",
        components=(Component(id="peg", mesh=peg, X_PC=np.eye(4), density_kg_m3=500.0),),
        obstacles=(),
        operations=(Operation(id="op-1", active=("peg",), passive=(), motion=down),),
    )
    plan = plan_of(options)
    runner = HereRunner(plan, build_toolbox(plan, load_registry()))
    return runner.get(pipeline.design(task, [ACTUATOR], plan, runner)), runner.ran


def handle(result: DesignResult) -> dict[str, Any]:
    (gripper,) = result.document["grippers"]
    (only,) = gripper["handles"]
    return dict(only)


def test_the_pad_of_the_plan_is_what_is_made_and_what_holds() -> None:
    thin, thick = (design(pad={"thickness": thickness, "rubber": "silicone"})[0] for thickness in (0.5, 1.5))

    for result, thickness in ((thin, 0.5), (thick, 1.5)):
        (cad,) = result.cads
        assert isinstance(cad, GripperCad)
        assert cad.finger.bonded is not None
        assert cad.spec.pad == Pad(thickness_mm=thickness, rubber="silicone")
        assert cad.finger.bonded.pad_size_mm[0] == thickness
        assert [row.material for row in result.bom if row.item == "pad"] == ["silicone rubber 70 Shore A"]
    areas = [handle(result)["hold"]["contact_area"] for result in (thin, thick)]
    assert areas[1] / areas[0] == pytest.approx(3.0 ** (1.0 / 3.0), rel=5e-3)  # strips grow with the cube root


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        ({"pad.thickness": 0.0}, "/options/pad/thickness"),
        ({"pad.rubber": "wood"}, "/options/pad/rubber"),
        ({"pad.colour": 1}, "/options/pad/colour"),
        ({"pad": 3, "pad.thickness": 1.0}, "/options/pad"),
    ],
)
def test_a_pad_that_cannot_be_is_refused_at_its_place(options: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidPlan) as refused:
        plan_of(options)

    assert [fault.pointer for fault in refused.value.faults] == [pointer]


def test_tips_are_shaped_where_the_plan_asks_for_it_and_the_document_states_the_offset() -> None:
    (flat, ran_flat), (hollow, ran) = design(), design(finger="concave")
    (cad,) = hollow.cads
    assert isinstance(cad, GripperCad)

    groove = cad.finger.properties["groove_radius_mm"]
    offset = handle(hollow)["contact_offset"]
    assert ("tips" in ran_flat, "tips" in ran) == (False, True)
    assert (handle(flat)["contact_offset"], handle(hollow)["verified"]) == (0.0, True)
    assert groove == pytest.approx(15.01, abs=0.05)
    assert offset == pytest.approx(groove - np.sqrt(groove**2 - 25.0), abs=1e-4)
    assert handle(flat)["opening_width"] - handle(hollow)["opening_width"] == pytest.approx(2.0 * offset, abs=0.1)
    assert handle(hollow)["hold"]["contact_area"] > handle(flat)["hold"]["contact_area"]
