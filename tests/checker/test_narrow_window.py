"""A block in a pocket whose slots for the fingers lie between the planned grasps: found, and judged by the checker."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from checker.bench import box, shifted
from checker.promises import check_design
from designed_products import COMPLETE, INCOMPLETE

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

ASIDE_MM = 1.67  # planned are 0 and 3.33 mm beside the middle


def pocketed(folder: Path, slot_mm: float) -> Path:
    """A block 20 × 30 × 30 set down 10 mm deep into a pocket; its fixture leaves a slot on either side of it."""
    pocket = box([-10.3, -15.3, 0], [10.3, 15.3, 60])
    slots = box([-24, ASIDE_MM - slot_mm / 2.0, 0], [24, ASIDE_MM + slot_mm / 2.0, 60])
    fixture = trimesh.boolean.difference([box([-40, -40, -10], [40, 40, 40]), trimesh.boolean.union([pocket, slots])])
    fixture.export(folder / "fixture.stl")
    box([-10, -15, 0], [10, 15, 30]).export(folder / "block.stl")
    operation = {
        "id": "op-01",
        "active": ["block"],
        "passive": [],
        "pose_before": shifted(0, 0, 100).tolist(),
        "pose_after": np.eye(4).tolist(),
    }
    component = {"id": "block", "file": "block.stl", "units": "mm", "pose": np.eye(4).tolist(), "density": 7850}
    fixture_entry = {"id": "fixture", "file": "fixture.stl", "units": "mm", "pose": np.eye(4).tolist()}
    product = {
        "part_number": "W-1",
        "revision": "A",
        "name": "Window",
        "components": [component],
        "environment": [fixture_entry],
        "operations": [operation],
    }
    (folder / "product.json").write_text(json.dumps(product))
    return folder


def test_a_grasp_that_only_a_narrow_window_leaves_is_found_and_keeps_every_promise(tmp_path: Path, designed: Any) -> None:
    package = pocketed(tmp_path, 12.0)
    code, folder = designed(package, ())
    ((handle,),) = [gripper["handles"] for gripper in json.loads((folder / "design.json").read_text())["grippers"]]

    assert code == COMPLETE
    assert abs(abs(handle["grasp_pose"][1][3]) - ASIDE_MM) < 1.0
    assert check_design(folder, package) == []


def test_without_a_window_the_reason_says_how_finely_was_searched(tmp_path: Path, designed: Any) -> None:
    code, folder = designed(pocketed(tmp_path, 9.5), ())
    (operation,) = json.loads((folder / "design.json").read_text())["operations"]

    assert code == INCOMPLETE
    assert "'fixture'" in operation["detail"]
    assert operation["detail"].endswith(", searched to 1.9°, 0.65 mm")
