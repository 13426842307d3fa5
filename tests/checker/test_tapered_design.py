"""Tapered tips: designed for cones and a pyramid, judged by the checker with the finished CAD, their angle read back."""

import csv
import json
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import pytest
import trimesh

from checker.bench import box, tube, write_set_down
from checker.promises import check_design
from designed_products import COMPLETE
from mesh_factory import mesh_of
from step_planes import plane_normals

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

TAPERED = (
    "fitters=cylinder,box,cone,pyramid",
    "rules=three_finger_cylinder,two_finger_box,three_finger_cone,two_finger_pyramid",
    "planners=axial,facet_pairs,tapered",
    "tapered.rotation_step=60",  # few grasps are enough here
    "tapered.depths=3",
    "sdf.rays=10",
)
PLATE_MM = 10.0


def cone(foot_mm: float, degrees: float, height_mm: float) -> trimesh.Trimesh:
    """It stands on its foot, z = 0."""
    top = foot_mm - height_mm * np.tan(np.radians(degrees))
    return _trimesh(manifold3d.Manifold.cylinder(height_mm, foot_mm, top, 192))


def pyramid(foot_mm: float, degrees: float, height_mm: float) -> trimesh.Trimesh:
    """A square one, `foot_mm` across its flats at z = 0."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    levels = ((foot_mm / 2.0, 0.0), (foot_mm / 2.0 - height_mm * np.tan(np.radians(degrees)), height_mm))
    return _trimesh(
        manifold3d.Manifold.hull_points(np.concatenate([np.column_stack([square * r, np.full(4, z)]) for r, z in levels]))
    )


def _trimesh(solid: manifold3d.Manifold) -> trimesh.Trimesh:
    mesh = mesh_of(solid)
    return trimesh.Trimesh(mesh.vertices_mm, mesh.faces)


@pytest.fixture(scope="session")
def stoppers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two cones of about 8° and a pyramid are set down on a plate, and a plug hangs with its narrow end in a hole of it."""
    folder = tmp_path_factory.mktemp("stoppers")
    plate = trimesh.boolean.difference(
        [box([-120, -50, 0], [120, 50, PLATE_MM]), tube(15.0, -5, 30).apply_translation([80, 0, 0])]
    )
    plug = cone(17.0, 8.0, 34.0).apply_transform(np.diag([1.0, -1.0, -1.0, 1.0])).apply_translation([80, 0, 36.0])
    shapes = {
        "plate": plate,
        "slim": cone(18.0, 8.1, 30.0).apply_translation([-80, 0, PLATE_MM]),
        "stout": cone(18.6, 7.9, 26.0).apply_translation([-20, 0, PLATE_MM]),
        "roof": pyramid(32.0, 10.0, 26.0).apply_translation([30, 0, PLATE_MM]),
        "plug": plug,
    }
    write_set_down(folder, shapes)
    return folder


def inclines_of(step: Path) -> list[float]:
    """Degrees to z of the planes of a STEP file that face neither along an axis nor along a mitre of the base."""
    inclined = [
        normal for normal in plane_normals(step) if abs(normal[1]) < 1e-6 and 0.01 < abs(normal[2]) < 0.6
    ]  # chamfers: 45°
    return [float(np.degrees(np.arcsin(abs(normal[2])))) for normal in inclined]


def test_straight_fingers_hold_neither_cones_nor_pyramids(stoppers: Path, designed: Any) -> None:
    _, folder = designed(stoppers, (TAPERED[0], "sdf.rays=10"))

    operations = json.loads((folder / "design.json").read_text())["operations"]
    assert {operation["id"] for operation in operations if operation["status"] == "covered"} == set()


def test_tapered_tips_hold_them_and_keep_every_promise(stoppers: Path, designed: Any) -> None:
    code, folder = designed(stoppers, TAPERED)
    design = json.loads((folder / "design.json").read_text())

    assert (code, check_design(folder, stoppers)) == (COMPLETE, [])
    held = {
        (gripper["gripper_type"], gripper["taper"]): {handle["component"] for handle in gripper["handles"]}
        for gripper in design["grippers"]
    }
    assert held == {
        ("centric-3", -8.0): {"slim", "stout"},
        ("centric-3", 8.0): {"plug"},
        ("parallel-2", -10.0): {"roof"},
    }
    for gripper in design["grippers"]:
        for handle in gripper["handles"]:
            extra = 2.0 * 10.0 * np.tan(np.radians(max(gripper["taper"], 0.0)))
            assert handle["release_opening"] - handle["opening_width"] == pytest.approx(1.0 + extra, abs=1e-3)
            assert handle["verified"]


def test_the_taper_stands_in_the_bill_of_materials_and_in_the_step_file(stoppers: Path, designed: Any) -> None:
    _, folder = designed(stoppers, TAPERED)
    grippers = json.loads((folder / "design.json").read_text())["grippers"]
    rows = list(csv.DictReader((folder / "bom.csv").open()))
    said = {row["gripper"]: (int(row["quantity"]), row["description"]) for row in rows if row["item"] == "finger"}

    for gripper in grippers:
        angle, end = abs(gripper["taper"]), "tips" if gripper["taper"] > 0 else "palm"
        quantity, description = said[gripper["id"]]
        assert quantity == gripper["fingers"]
        assert f"tapered {angle:.1f}° towards the {end}" in description
        assert inclines_of(folder / gripper["files"]["finger_step"]) == pytest.approx([angle], abs=1e-6)
        assert json.loads((folder / gripper["files"]["tool_json"]).read_text())["taper"] == gripper["taper"]
        assert f"{angle:.1f}° to z over 10" in (folder / gripper["files"]["finger_svg"]).read_text()
