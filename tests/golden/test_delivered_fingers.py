"""Every finger that is delivered for the sample and the public assemblies, read back by the CAD kernel and measured."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import trimesh
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from designed_products import PAPER, PUMP, Designed, shared_package
from gripwright.store.seed import seed_actuators

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PACKAGES = ("industreal-gears", "counter-plate-screws", "as1", "bolt-nut-m16")
PRODUCTS = {"sample": (PUMP, ()), "sample, paper": (PUMP, PAPER), **{name: (name, ()) for name in PACKAGES}}
JAWS_MM = {4.0: (7.0, 18.0, 4.5, 3.0), 3.0: (5.5, 17.0, 3.4, 3.0), 2.5: (3.8, 15.6, 2.9, 2.0)}
"""The jaws of docs/package.md by thread: setback, pitch, clearance hole (ISO 273, medium), pin."""


@pytest.fixture(params=PRODUCTS.values(), ids=PRODUCTS)
def folder(request: pytest.FixtureRequest, designed: Designed) -> Path:
    package, settings = request.param
    return designed(package if isinstance(package, Path) else shared_package(package), settings)[1]


def grippers(folder: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((folder / "design.json").read_text())["grippers"]
    return found


def solids_of(file: Path) -> list[Any]:
    """As a CAM program would read it."""
    reader = STEPControl_Reader()
    assert reader.ReadFile(str(file)) == IFSelect_ReturnStatus.IFSelect_RetDone
    reader.TransferRoots()
    return list(_explored(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_SOLID))


def _explored(shape: Any, kind: TopAbs_ShapeEnum) -> Iterator[Any]:
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def volume_mm3(solid: Any) -> float:
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, properties)
    return float(properties.Mass())


def holes(solid: Any) -> set[tuple[float, float, float]]:
    """(diameter, x, y) of the cylindrical faces whose axis is z."""
    found = set()
    for face in _explored(solid, TopAbs_ShapeEnum.TopAbs_FACE):
        surface = BRepAdaptor_Surface(TopoDS.Face(face))
        if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_Cylinder:
            cylinder = surface.Cylinder()
            place = cylinder.Axis().Location()
            if abs(cylinder.Axis().Direction().Z()) > 1.0 - 1e-9:
                found.add((round(2.0 * cylinder.Radius(), 3), round(place.X(), 3), round(place.Y(), 3)))
    return found


def test_each_step_file_is_one_valid_solid_as_large_as_its_stl(folder: Path) -> None:
    for gripper in grippers(folder):
        files = gripper["files"]
        for name in [key.removesuffix("_step") for key in files if key.endswith("_step") and not key.startswith("body")]:
            (solid,) = solids_of(folder / files[f"{name}_step"])
            mesh = trimesh.load_mesh(folder / files[f"{name}_stl"])

            assert BRepCheck_Analyzer(solid).IsValid(), name
            assert volume_mm3(solid) == pytest.approx(mesh.volume, rel=5e-3), name


def test_each_finger_has_holes_where_the_jaw_has_threads_and_pin(folder: Path) -> None:
    for gripper in grippers(folder):
        (solid,) = solids_of(folder / gripper["files"].get("finger_bare_step", gripper["files"]["finger_step"]))
        setback, pitch, through, pin = JAWS_MM[gripper["finger"]["bolt_thread_mm"]]

        x = setback - gripper["actuator"]["jaw_offset"]  # the jaw's reference stands at x = −jaw_offset
        found = {(diameter, y) for diameter, place, y in holes(solid) if place == pytest.approx(x, abs=2e-3)}
        assert {(through, -pitch / 2.0), (through, pitch / 2.0), (pin, 0.0)} <= found


def test_on_the_actuators_jaws_the_fingers_open_as_the_design_says(folder: Path) -> None:
    """The holes sit on the jaws' threads, half of what the actuator opens plus the setback from the gripper's axis."""
    catalogue = {actuator.name: actuator for actuator in seed_actuators()}
    for gripper in grippers(folder):
        record = gripper["actuator"]
        (solid,) = solids_of(folder / gripper["files"]["finger_step"])
        setback, _, through, _ = JAWS_MM[gripper["finger"]["bolt_thread_mm"]]
        (x,) = {place for diameter, place, _ in holes(solid) if diameter == through}
        known = catalogue[f"{record['maker']}/{record['model']}"].opening_max_mm
        open_mm = gripper["opening_max"] - 2.0 * record["jaw_offset"] if known is None else known

        for jaws_mm, opening in (
            (open_mm, gripper["opening_max"]),
            (open_mm - (gripper["opening_max"] - gripper["opening_min"]), gripper["opening_min"]),
        ):
            assert 2.0 * (jaws_mm / 2.0 + setback - x) == pytest.approx(opening, abs=0.02)
        assert gripper["opening_max"] - gripper["opening_min"] <= record["stroke"] + 1e-6


def test_each_finger_states_a_deflection_and_a_wall_within_their_limits(folder: Path) -> None:
    for gripper in grippers(folder):
        finger = gripper["finger"]

        assert 0.0 < finger["deflection_mm"] <= finger["deflection_max_mm"]
        assert finger["stress_MPa"] < finger["strength_MPa"]
        assert finger["wall_min_mm"] >= 1.2 - 1e-6
