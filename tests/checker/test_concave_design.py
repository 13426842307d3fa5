"""Concave tips: designed for discs of several radii, judged by the checker with the finished CAD."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from checker.bench import box, shifted, tube
from checker.promises import check_design
from designed_products import COMPLETE

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

THREE_FINGERS = ("rules=three_finger_cylinder", "hands=centric_3")
PLAY_MM = 0.01
RADII_MM = {"disc": 20.0, "ring": 19.0}


@pytest.fixture(scope="session")
def discs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two heavy discs that are set down one on the other, on a plate."""
    folder = tmp_path_factory.mktemp("discs")
    box([-40, -40, -10], [40, 40, 0]).export(folder / "plate.stl")
    tube(RADII_MM["disc"], 0, 15).export(folder / "disc.stl")
    tube(RADII_MM["ring"], 15, 30).export(folder / "ring.stl")
    components = [{"id": name, "file": f"{name}.stl", "units": "mm", "density": 7850} for name in ("plate", "disc", "ring")]
    operations = [
        {
            "id": f"op-{name}",
            "active": [name],
            "passive": passive,
            "pose_before": shifted(0, 0, 60).tolist(),
            "pose_after": np.eye(4).tolist(),
            "force": 20,
        }
        for name, passive in (("disc", ["plate"]), ("ring", ["plate", "disc"]))
    ]
    product = {"part_number": "D-1", "revision": "A", "name": "Discs", "components": components, "operations": operations}
    (folder / "product.json").write_text(json.dumps(product))
    return folder


def handles(folder: Path) -> dict[str, dict[str, Any]]:
    design = json.loads((folder / "design.json").read_text())
    return {handle["operation"]: handle for gripper in design["grippers"] for handle in gripper["handles"]}


def test_concave_tips_keep_every_promise_and_touch_at_the_bottom_of_their_groove(discs: Path, designed: Any) -> None:
    code, folder = designed(discs, (*THREE_FINGERS, "finger=concave"))
    (gripper,) = json.loads((folder / "design.json").read_text())["grippers"]

    assert (code, check_design(folder, discs)) == (COMPLETE, [])
    groove = gripper["finger"]["groove_radius_mm"]
    depth = groove - np.sqrt(groove**2 - 25.0)
    for name, radius in RADII_MM.items():
        handle = handles(folder)[f"op-{name}"]
        assert handle["contact_offset"] == pytest.approx(depth, abs=1e-4)
        facets = radius * (1.0 / np.cos(np.pi / 96.0) - 1.0)  # the corners of the polygon stand out so far
        assert 0.0 <= handle["opening_width"] - 2.0 * (radius - depth) <= 2.0 * (facets + PLAY_MM)


def test_what_fills_its_groove_is_touched_over_more_area_and_nothing_needs_more_force(discs: Path, designed: Any) -> None:
    """Strips grow with the cube root of the relative radius, which ends where a pad of 1 mm, pressed by 0.2, is 10 mm wide."""
    flat, hollow = (handles(designed(discs, (*THREE_FINGERS, f"finger={key}"))[1]) for key in ("straight", "concave"))

    wider = np.cbrt(10.0**2 / (8.0 * 0.2) / RADII_MM["disc"])
    assert hollow["op-disc"]["hold"]["contact_area"] == pytest.approx(wider * flat["op-disc"]["hold"]["contact_area"], rel=2e-3)
    for operation, handle in flat.items():
        assert hollow[operation]["hold"]["required_force"] <= handle["hold"]["required_force"]
