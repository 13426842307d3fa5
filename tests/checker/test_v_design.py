"""V tips: two fingers hold cones and cylinders along their axis, judged by the checker with the finished CAD."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from checker.bench import box, tube, write_set_down
from checker.contact import contact_height
from checker.gripper import Gripper, finger_pose
from checker.package import read_package
from checker.promises import check_design
from checker.shapes import placed
from checker.test_tapered_design import cone
from designed_products import COMPLETE, INCOMPLETE
from step_planes import plane_normals

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

PLATE_MM = 10.0
WITHOUT_V = (
    "fitters=cylinder,box,cone",
    "rules=two_finger_box",
    "planners=facet_pairs,tapered",
    "hands=parallel_2",
    "tapered.rotation_step=60",  # few grasps are enough here
    "tapered.depths=3",
    "sdf.rays=10",
    "finest_rotation=15",
    "finest_step=5",
)
WITH_V = (WITHOUT_V[0], "rules=two_finger_box,two_finger_cone,two_finger_cylinder", *WITHOUT_V[2:])


@pytest.fixture(scope="session")
def pins(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two pins and a stopper are set down on a plate, and a plug hangs with its narrow end in a hole of it."""
    folder = tmp_path_factory.mktemp("pins")
    plate = trimesh.boolean.difference([box([-120, -40, 0], [90, 40, PLATE_MM]), tube(7.5, -5, 30).apply_translation([50, 0, 0])])
    plug = cone(9.0, 8.0, 30.0).apply_transform(np.diag([1.0, -1.0, -1.0, 1.0])).apply_translation([50, 0, 34.0])
    shapes = {
        "plate": plate,
        "stopper": cone(8.5, 8.1, 24.0).apply_translation([-50, 0, PLATE_MM]),
        "pin": cone(7.0, 0.0, 26.0).apply_translation([0, 0, PLATE_MM]),
        "thin": cone(5.5, 0.0, 20.0).apply_translation([-95, 0, PLATE_MM]),
        "plug": plug,
    }
    write_set_down(folder, shapes)
    return folder


def flanks_of(step: Path) -> list[tuple[float, float, float]]:
    """Normals of the planes of a STEP file that face −x and aside, and lie along no mitre of the base: those of a V."""
    normals = plane_normals(step)
    return [tuple(np.abs(normal).tolist()) for normal in normals if 0.3 < abs(normal[1]) < 0.6 and abs(normal[0]) > 0.8]


def test_two_straight_fingers_hold_neither_cones_nor_cylinders(pins: Path, designed: Any) -> None:
    code, folder = designed(pins, WITHOUT_V)

    design = json.loads((folder / "design.json").read_text())
    assert (code, design["grippers"]) == (INCOMPLETE, [])
    assert {operation["status"] for operation in design["operations"]} == {"uncovered"}


def test_v_tips_hold_them_and_keep_every_promise(pins: Path, designed: Any) -> None:
    code, folder = designed(pins, WITH_V)
    design = json.loads((folder / "design.json").read_text())

    assert (code, design["status"], check_design(folder, pins)) == (COMPLETE, "complete", [])
    held = {gripper.get("taper", 0.0): {handle["component"] for handle in gripper["handles"]} for gripper in design["grippers"]}
    assert held == {0.0: {"pin", "thin"}, -8.0: {"stopper"}, 8.0: {"plug"}}
    for gripper in design["grippers"]:
        assert (gripper["gripper_type"], gripper["v_angle"], gripper["v_depth"]) == ("parallel-2", 120.0, 3.0)
        for handle in gripper["handles"]:
            extra = 2.0 * 10.0 * np.tan(np.radians(max(gripper.get("taper", 0.0), 0.0))) / np.cos(np.radians(30.0))
            assert handle["release_opening"] - handle["opening_width"] == pytest.approx(1.0 + extra, abs=1e-3)
            assert handle["verified"]
    (pin,) = (handle for gripper in design["grippers"] for handle in gripper["handles"] if handle["component"] == "pin")
    assert pin["opening_width"] == pytest.approx(2.0 * (7.0 / np.cos(np.radians(30.0)) - 3.0), abs=0.02)
    assert pin["contact_offset"] == pytest.approx(7.0 * np.cos(np.radians(30.0)) - pin["opening_width"] / 2.0, abs=0.02)


def test_each_flank_by_itself_touches_as_high_as_a_contact_has_to_be(pins: Path, designed: Any) -> None:
    """The checker asks for one contact a finger; here it is shown one half of the component after the other."""
    _, folder = designed(pins, WITH_V)
    package = read_package(pins)

    for record in json.loads((folder / "design.json").read_text())["grippers"]:
        gripper = Gripper.read(folder, record)
        for handle in record["handles"]:
            held = package.components[handle["component"]].mesh.subdivide_to_size(1.0)
            for angle in gripper.angles_rad:
                to_finger = np.linalg.inv(np.array(handle["grasp_pose"]) @ finger_pose(angle, handle["opening_width"]))
                seen = placed(held, to_finger)
                for side in (-1.0, 1.0):
                    half = trimesh.Trimesh(seen.vertices, seen.faces[side * seen.triangles_center[:, 1] > 0.5], process=False)
                    assert contact_height(gripper.finger, half, -1.0) >= 3.0 - 0.11


def test_the_v_stands_in_the_bill_of_materials_in_tool_data_in_the_drawing_and_in_the_step_file(
    pins: Path, designed: Any
) -> None:
    _, folder = designed(pins, WITH_V)
    design = json.loads((folder / "design.json").read_text())
    rows = list(csv.DictReader((folder / "bom.csv").open()))
    said = {row["gripper"]: (int(row["quantity"]), row["description"]) for row in rows if row["item"] == "finger"}

    for gripper in design["grippers"]:
        taper = gripper.get("taper", 0.0)
        quantity, description = said[gripper["id"]]
        assert quantity == 2
        assert "V of 120.0°, 3 mm deep" in description
        assert ("tapered 8.0°" in description) == bool(taper)
        tool = json.loads((folder / gripper["files"]["tool_json"]).read_text())
        assert (tool["v_angle"], tool["v_depth"], tool.get("taper", 0.0)) == (120.0, 3.0, taper)
        flat, tilt = np.radians(30.0), np.radians(abs(taper))
        normal = [np.cos(flat) * np.cos(tilt), np.sin(flat) * np.cos(tilt), np.sin(tilt)]
        assert np.array(flanks_of(folder / gripper["files"]["finger_step"])) == pytest.approx(np.array([normal] * 2), abs=1e-6)
        assert "V of 120.0°, 3 deep" in (folder / gripper["files"]["finger_svg"]).read_text()
    segments = [segment for component in design["components"] for segment in component["segments"]]
    assert {segment["v_angle"] for segment in segments if segment["rule"] in ("two_finger_cone", "two_finger_cylinder")} == {
        120.0
    }
    assert "V of 120.0°, 3 mm deep" in (folder / "report.html").read_text()
