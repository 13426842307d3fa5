"""A component that cannot be held: one sentence says why, the same at the command line, over HTTP and in the report."""

import html
import json
import os
import re
import subprocess
import sys
import time

import httpx
import numpy as np
import pytest
import trimesh

from service_process import running_service

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]
CLEARANCE_MM, MARGIN_MM = 2.0, 0.1  # between plug and frame; that is asked for
FINGER_MM, FINGER_WIDE_MM = 8.0, 10.0  # thickness, width
FRAME_TOP_MM, PLUG_TOP_MM = 30.0, 25.0


def box(low, high):
    return trimesh.creation.box(bounds=[low, high])


def write_package(folder):
    """A plate, and a plug that is set down on it within a frame which stands there in that operation alone."""
    plug, hole = (np.array([half, half]) for half in (10.0, 10.0 + CLEARANCE_MM))
    frame = trimesh.boolean.difference(
        [box([-60, -60, 5], [60, 60, FRAME_TOP_MM]), box([*-hole, 0], [*hole, 2.0 * FRAME_TOP_MM])]
    )
    meshes = {"plate": box([-40, -40, 0], [40, 40, 5]), "plug": box([*-plug, 5], [*plug, PLUG_TOP_MM]), "frame": frame}
    folder.mkdir()
    for name, mesh in meshes.items():
        mesh.export(folder / f"{name}.stl")
    above = np.eye(4)
    above[2, 3] = 100.0
    entries = {
        name: {"id": name, "file": f"{name}.stl", "units": "mm", "pose": np.eye(4).tolist(), "part_number": name, "revision": "A"}
        for name in meshes
    }
    moves = {"pose_before": above.tolist(), "pose_after": np.eye(4).tolist()}
    document = {
        "part_number": "PLUG-1",
        "revision": "A",
        "name": "A plug in a frame",
        "components": [entries["plate"], entries["plug"]],
        "environment": [{key: entries["frame"][key] for key in ("id", "file", "units", "pose")} | {"operations": ["op-02"]}],
        "operations": [
            {"id": "op-01", "active": ["plate"], "passive": [], **moves},
            {"id": "op-02", "active": ["plug"], "passive": ["plate"], **moves},
        ],
    }
    (folder / "product.json").write_text(json.dumps(document))
    return folder


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    return {**os.environ, "GRIPWRIGHT_DATA": str(tmp_path_factory.mktemp("data")), "GRIPWRIGHT_WORKERS": "1"}


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return write_package(tmp_path_factory.mktemp("product") / "package")


@pytest.fixture(scope="module")
def printed(package, environment, tmp_path_factory):
    """What the command line printed, and the design folder."""
    out = tmp_path_factory.mktemp("design") / "out"
    command = [sys.executable, "-m", "gripwright.cli", "design", str(package), "--out", str(out)]
    answer = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=200, check=False)
    assert answer.returncode == 3, answer.stderr
    return answer.stdout, out


@pytest.fixture(scope="module")
def uncovered(printed):
    """The one operation that has a reason, as design.json holds it."""
    (found,) = [entry for entry in json.loads((printed[1] / "design.json").read_text())["operations"] if entry["detail"]]
    return found


@pytest.fixture(scope="module")
def sentence(uncovered):
    return uncovered["detail"]


def test_the_sentence_says_what_is_hit_by_how_much_where_and_in_which_operation(uncovered, sentence):
    """The plug has 2 of room beside it and a finger takes 8, from where its tips come down to the frame's top.

    The grasp may be turned about the contact normal: the lower corner of a tip, the margin around it, comes down first.
    """
    into_mm = FINGER_MM - CLEARANCE_MM
    _, along_y, along_z, tips_mm = uncovered["nearest_miss"]["grasp_pose"][2]  # at its seat the plug's frame is the product's
    below_mm = abs(along_y) * (FINGER_WIDE_MM / 2.0 + MARGIN_MM) - along_z * MARGIN_MM
    from_mm = FRAME_TOP_MM + below_mm - tips_mm

    told = re.fullmatch(
        r"plug cannot be held in op-02: gripped across 20\.0 mm \(segment \d+\), finger [12] would enter 'frame' by ([\d.]+) mm "
        r"\(0\.10 mm of clearance is required\) with its outer face, on the way down, from ([\d.]+) mm above its seat onwards; "
        r"that is the closest found of \d+ grasps on .+",
        sentence,
    )

    assert told is not None, sentence
    assert float(told[1]) == pytest.approx(into_mm, abs=0.01)
    assert float(told[2]) == pytest.approx(from_mm, abs=0.06)  # a tenth is told
    assert tips_mm < PLUG_TOP_MM


def test_an_obstacle_stands_in_the_operations_that_name_it_alone(printed):
    operations = json.loads((printed[1] / "design.json").read_text())["operations"]

    assert [(entry["id"], entry["status"]) for entry in operations] == [("op-01", "covered"), ("op-02", "uncovered")]


def test_the_command_line_prints_the_sentence(printed, sentence):
    assert sentence in printed[0]


def test_the_report_has_the_sentence_at_the_operation_and_at_the_component(printed, sentence):
    page = html.unescape((printed[1] / "report.html").read_text())

    assert page.count(sentence) >= 2


def test_the_service_answers_with_the_sentence_at_the_operation_and_at_the_component(package, environment, sentence):
    with running_service(**environment) as service:
        address = service.address
        files = [("files", (file.name, file.read_bytes())) for file in sorted(package.glob("*.stl"))]
        uploaded = httpx.post(
            f"{address}/api/v1/products", files=[*files, ("manifest", (None, (package / "product.json").read_text()))], timeout=60
        )
        assert uploaded.status_code == 201, uploaded.text
        accepted = httpx.post(f"{address}/api/v1/products/{uploaded.json()['id']}/designs", json={}, timeout=60)
        body = finished(address + accepted.headers["Location"])

    design = body["design"]
    assert body["status"] == "incomplete"
    assert {entry["id"]: entry["detail"] for entry in design["operations"]} == {"op-01": None, "op-02": sentence}
    assert {entry["id"]: entry["detail"] for entry in design["components"]} == {"plate": None, "plug": sentence}


def finished(url):
    deadline = time.monotonic() + 200
    while (body := httpx.get(url, timeout=30).json())["status"] in ("queued", "running"):
        assert time.monotonic() < deadline, body
        time.sleep(0.3)
    return body
