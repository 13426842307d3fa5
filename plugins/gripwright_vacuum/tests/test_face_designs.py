"""Whole designs by the command line, as a user would run them: faces where jaws do not reach, jaws where they do."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pocketed_product import CATALOGUE, FACES, JAWS, stl_corners, write_package

JAWS_PLAN = {"rules": ["three_finger_cylinder", "two_finger_box"], "hands": ["centric_3", "parallel_2"], "finger": "straight"}
COMPLETE, INCOMPLETE = 0, 3


def plan_with(rule: str, hand: str, holding: str, finger: str) -> dict[str, Any]:
    return {
        "rules": [*JAWS_PLAN["rules"], rule],
        "hands": [*JAWS_PLAN["hands"], hand],
        "planners": ["axial", "facet_pairs", "flat_faces"],
        "holding": [holding],
        "finger": ["straight", finger],
    }


VACUUM = plan_with("vacuum_face", "vacuum_1", "vacuum", "suction_cup")
MAGNETIC = plan_with("magnetic_face", "magnetic_1", "magnetic", "pole_shoe")


class Workshop:
    """Runs the command with a catalogue of its own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._environment = os.environ | {"GRIPWRIGHT_DATA": str(folder / "data")}
        (folder / "actuators.csv").write_text(CATALOGUE)
        imported = self._run("actuators", "import", str(folder / "actuators.csv"))
        assert imported.returncode == 0, imported.stderr

    def design(self, package: Path, name: str, options: dict[str, Any]) -> tuple[int, Path]:
        out = self._folder / name
        settings = [f"{key}={json.dumps(value)}" for key, value in {**options, "actuators": JAWS + FACES}.items()]
        done = self._run("design", str(package), "--out", str(out), *(word for one in settings for word in ("--set", one)))
        assert done.returncode in (COMPLETE, INCOMPLETE), done.stderr
        return done.returncode, out

    def _run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "gripwright.cli", *arguments]
        return subprocess.run(command, env=self._environment, capture_output=True, text=True, timeout=280, check=False)


@pytest.fixture(scope="module")
def workshop(tmp_path_factory) -> Workshop:
    return Workshop(tmp_path_factory.mktemp("workshop"))


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    return write_package(tmp_path_factory.mktemp("product") / "flush", texture="machined", ferrous=True)


@pytest.fixture(scope="module")
def by_vacuum(workshop, package) -> tuple[int, Path]:
    return workshop.design(package, "vacuum", VACUUM)


def document_of(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "design.json").read_text()))


def by_operation(document: dict[str, Any]) -> dict[str, str]:
    return {handle["operation"]: gripper["gripper_type"] for gripper in document["grippers"] for handle in gripper["handles"]}


def test_jaws_alone_leave_out_what_lies_flush(workshop, package) -> None:
    coarse = {"finest_rotation": 180.0, "finest_step": 100.0}  # the walls leave no room, however finely one looks
    code, folder = workshop.design(package, "jaws", {**JAWS_PLAN, "planners": ["axial", "facet_pairs"], **coarse})

    status = {operation["id"]: operation["status"] for operation in document_of(folder)["operations"]}
    assert code == INCOMPLETE
    assert status == {"op-plate": "uncovered", "op-insert": "uncovered", "op-pin": "covered"}


def test_one_cup_for_both_plates_beside_jaws_for_the_pin_is_proven_the_fewest(by_vacuum) -> None:
    code, folder = by_vacuum
    document = document_of(folder)

    assert code == COMPLETE
    assert by_operation(document) == {"op-plate": "vacuum-1", "op-insert": "vacuum-1", "op-pin": "centric-3"}
    assert (len(document["grippers"]), document["optimum"]["lower_bound"], document["optimum"]["proven"]) == (2, 2, True)


def test_the_cup_holds_with_its_own_share_of_the_suction(by_vacuum) -> None:
    (gripper,) = (one for one in document_of(by_vacuum[1])["grippers"] if one["gripper_type"] == "vacuum-1")

    assert gripper["grip"] == "surface"
    assert gripper["opening_min"] == gripper["opening_max"]
    for handle in gripper["handles"]:
        assert handle["release_opening"] == handle["opening_width"] == gripper["opening_max"]
        largest = 80.0 if gripper["actuator"]["model"] == "Ejector 80" else 32.0
        assert handle["hold"]["grip_force"] == pytest.approx(
            gripper["actuator"]["grip_force"] * (gripper["opening_max"] / largest) ** 2, rel=1e-3
        )
        assert handle["hold"]["safety_factor"] >= 2.0
        assert handle["verified"]


def test_the_delivered_cup_lies_on_the_plate_and_enters_nothing(by_vacuum) -> None:
    document, folder = document_of(by_vacuum[1]), by_vacuum[1]

    (gripper,) = (one for one in document["grippers"] if one["gripper_type"] == "vacuum-1")
    cup = stl_corners(folder / gripper["files"]["finger_stl"])
    for handle in gripper["handles"]:
        X = np.array(handle["grasp_pose"])
        heights = (cup @ X[:3, :3].T + X[:3, 3])[:, 2]  # the plates' tops lie at z = 0
        assert np.allclose(X[:3, 2], [0.0, 0.0, -1.0])
        assert 0.0 < heights.min() < 0.05
        lip = cup[cup[:, 2] > -1e-6]
        assert 2.0 * np.hypot(lip[:, 0], lip[:, 1]).max() == pytest.approx(gripper["opening_max"], abs=0.05)


def test_the_bill_says_what_to_buy_and_what_to_make(by_vacuum) -> None:
    document, folder = document_of(by_vacuum[1]), by_vacuum[1]

    (gripper,) = (one for one in document["grippers"] if one["gripper_type"] == "vacuum-1")
    rows = [row for row in csv.DictReader((folder / "bom.csv").open()) if row["gripper"] == gripper["id"]]
    size = f"{gripper['opening_max']:g}"
    assert [(row["item"], row["make_or_buy"], row["quantity"]) for row in rows] == [
        ("actuator", "buy", "1"),
        ("cup holder", "make", "1"),
        ("suction cup", "buy", "1"),
        ("screw", "buy", "2"),
        ("O-ring", "buy", "1"),
    ]
    assert rows[0]["description"] == "vacuum-1 gripper actuator"
    assert rows[2]["part_number"].startswith(f"flat suction cup {size} mm, NBR, ")
    assert all((folder / name).is_file() for row in rows for name in row["files"].split("; ") if name)


def test_report_and_drawing_speak_of_a_face_not_of_jaws(by_vacuum) -> None:
    document, folder = document_of(by_vacuum[1]), by_vacuum[1]

    (gripper,) = (one for one in document["grippers"] if one["gripper_type"] == "vacuum-1")
    drawing = (folder / gripper["files"]["finger_svg"]).read_text()
    urdf = (folder / gripper["files"]["gripper_urdf"]).read_text()
    assert f"holds by a face of ⌀{gripper['opening_max']:.4g} mm" in (folder / "report.html").read_text()
    assert f"Cup holder of gripper {gripper['id']}" in drawing
    assert f"Make 1, for Sample/{gripper['actuator']['model']}." in drawing
    assert "jaw" not in drawing
    assert 'type="fixed"' in urdf
    assert "prismatic" not in urdf


def test_a_magnet_holds_what_is_ferrous(workshop, package) -> None:
    code, folder = workshop.design(package, "magnetic", MAGNETIC)
    document = document_of(folder)

    assert code == COMPLETE
    assert by_operation(document) == {"op-plate": "magnetic-1", "op-insert": "magnetic-1", "op-pin": "centric-3"}
    assert all(handle["verified"] for gripper in document["grippers"] for handle in gripper["handles"])


def test_a_rule_whose_hand_the_plan_does_not_name_says_so(workshop, package) -> None:
    code, folder = workshop.design(
        package, "lacking", {**VACUUM, "rules": ["vacuum_face"], "hands": JAWS_PLAN["hands"], "holding": []}
    )

    assert code == INCOMPLETE
    (plate,) = (one for one in document_of(folder)["components"] if one["id"] == "plate")
    assert any("no hand model, no holding model" in (segment["detail"] or "") for segment in plate["segments"])
