import json
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from gripwright.design.stages.fingers import GripperCad, design_gripper_cad
from gripwright.domain.grasp import EXTERNAL
from gripwright.domain.gripper import Actuator, Gripper
from gripwright.geometry import brep
from gripwright.plugin_api import HandModel, RunContext
from gripwright.report.tool_data import gripper_urdf, solid_body, tool_json
from gripwright_builtin.fingers.straight import StraightFinger, StraightFingerParams
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings


def make_tool(fingers: int, mass_kg: float | None = 0.5) -> tuple[Gripper, GripperCad, HandModel]:
    hand: HandModel = ParallelHand(HandSettings()) if fingers == 2 else CentricHand(CentricSettings())
    actuator = Actuator(
        maker="M & N",
        model='"1"',
        gripper_type=hand.gripper_type,
        stroke_mm=8.0,
        opening_max_mm=42.0,
        grip_force_N=12.0,
        mass_kg=mass_kg,
        body_diameter_mm=40.0,
        body_length_mm=55.0,
    )
    gripper = Gripper(
        id="G1",
        gripper_type=hand.gripper_type,
        fingers=fingers,
        grip=EXTERNAL,
        opening_min_mm=52.5,
        opening_max_mm=60.5,
        finger_length_mm=30.0,
        actuator=actuator,
        jaw_offset_mm=9.25,
        envelope_mm=50.0,
        handles=(),
    )
    designer: Any = StraightFinger(StraightFingerParams())
    cad = design_gripper_cad(gripper, designer, hand, [], 40.0, 55.0, 0.0, 2.0, RunContext())
    assert isinstance(cad, GripperCad)
    return gripper, cad, hand


def origin(element: ElementTree.Element) -> np.ndarray:
    """The pose of an <origin> turned about z, lengths in mm."""
    found = element.find("origin")
    assert found is not None
    roll, pitch, yaw = map(float, found.attrib["rpy"].split())
    assert (roll, pitch) == (0.0, 0.0)
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:3, 3] = 1000.0 * np.array(list(map(float, found.attrib["xyz"].split())))
    return pose


@pytest.mark.parametrize("fingers", [2, 3])
def test_the_joints_put_the_fingers_where_the_hand_has_them_at_every_opening(fingers: int) -> None:
    gripper, cad, hand = make_tool(fingers)
    robot = ElementTree.fromstring(gripper_urdf(gripper, cad, hand))
    joints = {joint.attrib["name"]: joint for joint in robot.iter("joint")}
    X_LG = origin(joints["tcp-joint"])

    for opening in (gripper.opening_min_mm, 55.1, gripper.opening_max_mm):
        travel = (opening - gripper.opening_min_mm) / 2.0
        for i in range(fingers):
            joint = joints[f"finger-{i + 1}-joint"]
            limit, axis = joint.find("limit"), joint.find("axis")
            assert limit is not None
            assert axis is not None
            assert float(limit.attrib["lower"]) == 0.0
            assert float(limit.attrib["upper"]) == pytest.approx(0.004)
            moved = np.eye(4)
            moved[:3, 3] = travel * np.array(list(map(float, axis.attrib["xyz"].split())))
            X_GF = np.linalg.inv(X_LG) @ origin(joint) @ moved
            angle = 2.0 * np.pi * i / fingers
            cos, sin = np.cos(angle), np.sin(angle)
            expected = np.array([[cos, -sin, 0, cos * opening / 2], [sin, cos, 0, sin * opening / 2], [0, 0, 1, 0], [0, 0, 0, 1]])
            np.testing.assert_allclose(X_GF, expected, atol=2e-6)


def test_the_description_is_one_tree_of_meshes_in_metres_whose_flange_is_the_bodys_back() -> None:
    gripper, cad, hand = make_tool(3)
    robot = ElementTree.fromstring(gripper_urdf(gripper, cad, hand))

    links = [link.attrib["name"] for link in robot.iter("link")]
    assert links == ["body", "finger-1", "finger-2", "finger-3", "tcp"]
    assert [child.attrib["link"] for child in robot.iter("child")] == links[1:]
    assert {parent.attrib["link"] for parent in robot.iter("parent")} == {"body"}
    assert [mesh.attrib["filename"] for mesh in robot.iter("mesh")] == ["body.stl"] * 2 + ["finger.stl"] * 6
    assert {mesh.attrib["scale"] for mesh in robot.iter("mesh")} == {"0.001 0.001 0.001"}
    placed = origin(robot.findall("link/visual")[0])[2, 3] + cad.body.vertices_mm[:, 2]
    assert placed.min() == pytest.approx(0.0, abs=1e-6)
    assert [float(limit.attrib["effort"]) for limit in robot.iter("limit")] == [pytest.approx(4.0)] * 3
    masses = [float(mass.attrib["value"]) for mass in robot.iter("mass")]
    assert sum(masses) == pytest.approx(json.loads(tool_json(gripper, cad))["mass"])


def test_the_tool_states_its_tip_its_mass_and_both_states() -> None:
    gripper, cad, _ = make_tool(2)
    tool = json.loads(tool_json(gripper, cad))

    depth = -cad.body.vertices_mm[:, 2].min()
    assert tool["tcp"] == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, pytest.approx(depth)], [0, 0, 0, 1]]
    assert tool["mass"] == pytest.approx(0.5 + 2 * cad.finger.mass_kg)
    assert tool["actuator_mass_known"] is True
    x, y, z = tool["centre_of_gravity"]
    assert abs(x) < 0.1
    assert abs(y) < 0.1
    assert 0.0 < z < depth
    assert tool["open"] == {"opening": 60.5, "joint": 0.004}
    assert tool["closed"] == {"opening": 52.5, "joint": 0.0}
    assert (tool["finger_length"], tool["actuator"]["maker"]) == (30.0, "M & N")


def test_a_mass_that_is_not_known_is_said_to_be_none_of_the_makers() -> None:
    gripper, cad, _ = make_tool(2, mass_kg=None)

    tool = json.loads(tool_json(gripper, cad))

    assert tool["actuator_mass_known"] is False
    assert tool["mass"] > 2 * cad.finger.mass_kg


def test_the_inertia_of_a_box_is_that_of_the_textbook() -> None:
    mesh = brep.tessellate(brep.box((10.0, -20.0, 5.0), (30.0, 40.0, 95.0)))

    body = solid_body(mesh, 1.2)

    np.testing.assert_allclose(body.centre_mm, [20.0, 10.0, 50.0])
    a, b, c = 0.02, 0.06, 0.09
    expected = np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2]) * 1.2 / 12.0
    np.testing.assert_allclose(body.inertia_kg_m2, expected, atol=1e-12)
