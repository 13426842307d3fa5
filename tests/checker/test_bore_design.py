"""A bush flush in its housing can be held from inside alone: designed, judged by the checker, its finger read back."""

import html
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.STEPControl import STEPControl_Reader

from checker.bench import box, shifted, tube
from checker.promises import check_design
from designed_products import COMPLETE, INCOMPLETE, PAPER
from gripwright.geometry import brep
from gripwright.geometry.measures import volume_mm3

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

OUTSIDE_ONLY = ("rules=three_finger_cylinder,two_finger_box",)
BY_DEFAULT: tuple[str, ...] = ()


@pytest.fixture(scope="session")
def bush(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bush 30 × 20 × 12 pressed with 30 N into a housing, until its end is level with the housing's."""
    folder = tmp_path_factory.mktemp("bush")
    housing = trimesh.boolean.difference([box([-30, -30, 0], [30, 30, 20]), tube(15.0, 8, 30), tube(10.0, -10, 30)])
    housing.export(folder / "housing.stl")
    tube(15.0, 8, 20, bore_mm=10.0).export(folder / "bush.stl")
    components = [
        {"id": name, "file": f"{name}.stl", "units": "mm", "pose": np.eye(4).tolist(), "density": 7850}
        for name in ("housing", "bush")
    ]
    operation = {
        "id": "op-01",
        "active": ["bush"],
        "passive": ["housing"],
        "pose_before": shifted(0, 0, 60).tolist(),
        "pose_after": np.eye(4).tolist(),
        "fit": "press",
        "force": 30,
    }
    product = {"part_number": "B-1", "revision": "A", "name": "Bush", "components": components, "operations": [operation]}
    (folder / "product.json").write_text(json.dumps(product))
    return folder


def test_from_outside_it_cannot_be_held(bush: Path, designed: Any) -> None:
    code, folder = designed(bush, OUTSIDE_ONLY)

    assert code == INCOMPLETE
    assert "housing" in json.loads((folder / "design.json").read_text())["operations"][0]["detail"]


def test_why_not_is_one_sentence_with_body_and_measure_in_the_document_and_the_report(bush: Path, designed: Any) -> None:
    _, folder = designed(bush, OUTSIDE_ONLY)
    document = json.loads((folder / "design.json").read_text())
    (operation,) = document["operations"]
    (entry,) = [component for component in document["components"] if component["id"] == "bush"]
    miss = operation["nearest_miss"]
    page = html.unescape((folder / "report.html").read_text())

    assert (miss["component"], miss["hit"], miss["unit"]) == ("bush", "housing", "mm")
    assert miss["limit"] - miss["found"] == pytest.approx(miss["amount"], abs=1e-3)
    assert operation["detail"] == entry["detail"]
    assert operation["detail"].startswith(f"bush cannot be held in {operation['id']}: {miss['sentence']}")
    assert operation["detail"] in page
    assert "nearest miss of op-01" in page  # its picture
    for segment in entry["segments"]:
        assert segment["detail"]
        assert segment["nearest_miss"] is None or segment["detail"].startswith(segment["nearest_miss"]["sentence"])


def test_the_command_ends_with_the_same_sentence(bush: Path, designed: Any, tmp_path: Path) -> None:
    _, folder = designed(bush, OUTSIDE_ONLY)
    (operation,) = json.loads((folder / "design.json").read_text())["operations"]
    command = [str(Path(sys.executable).parent / "gripwright"), "design", str(bush), "--out", str(tmp_path / "design")]
    environment = os.environ | {"GRIPWRIGHT_DATA": str(folder.parent / "data")}  # all its steps are stored there

    answer = subprocess.run([*command, "--set", OUTSIDE_ONLY[0]], env=environment, capture_output=True, text=True, check=False)

    assert answer.returncode == INCOMPLETE
    assert f"op-01 is uncovered: {operation['detail']}" in answer.stdout


def test_from_inside_it_is_held_by_fingers_that_keep_every_promise(bush: Path, designed: Any) -> None:
    code, folder = designed(bush, BY_DEFAULT)
    (gripper,) = json.loads((folder / "design.json").read_text())["grippers"]
    (handle,) = gripper["handles"]

    assert code == COMPLETE
    assert check_design(folder, bush) == []
    assert (gripper["grip"], gripper["gripper_type"]) == ("internal", "centric-3")
    assert handle["opening_width"] == pytest.approx(20.0, abs=0.02)
    assert gripper["opening_min"] <= handle["release_opening"] <= handle["opening_width"] - 1.0
    assert handle["hold"]["safety_factor"] >= 2.0


def test_the_papers_plan_holds_nothing_from_inside(bush: Path, designed: Any) -> None:
    code, folder = designed(bush, PAPER)
    segments = json.loads((folder / "design.json").read_text())["components"][1]["segments"]

    assert code == INCOMPLETE
    assert {segment["grip"] for segment in segments} <= {None, "external"}


def test_its_finger_is_a_valid_solid_with_a_round_nose_at_x_zero(bush: Path, designed: Any) -> None:
    _, folder = designed(bush, BY_DEFAULT)
    (gripper,) = json.loads((folder / "design.json").read_text())["grippers"]
    reader = STEPControl_Reader()
    assert reader.ReadFile(str(folder / gripper["files"]["finger_step"])) == IFSelect_ReturnStatus.IFSelect_RetDone
    reader.TransferRoots()

    solid = brep.single_solid(reader.OneShape())
    mesh = brep.tessellate(solid, angle_rad=0.02)
    stem = mesh.vertices_mm[mesh.vertices_mm[:, 2] > -gripper["finger_length"] + 0.01]
    radius = gripper["finger"]["nose_radius_mm"]
    nose = stem[stem[:, 0] > -0.49 * radius]
    assert brep.measure(solid).volume_mm3 == pytest.approx(volume_mm3(mesh), rel=5e-3)
    assert np.abs([stem[:, 0].max(), stem[:, 2].max()]).max() < 1e-3
    assert np.hypot(nose[:, 0] + radius, nose[:, 1]) == pytest.approx(np.full(len(nose), radius), abs=1e-6)
    assert f"R{radius:g}" in (folder / gripper["files"]["finger_svg"]).read_text()
