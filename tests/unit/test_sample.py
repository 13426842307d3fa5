"""The sample product: sound CAD, a sequence without collisions, and room for the gripper that each component is made for."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import pytest
import trimesh
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader

from gripwright import samples
from gripwright.cad.manifest import read_manifest
from gripwright.geometry.frames import is_rigid

PUMP = Path(samples.__file__).parent / "pump"
DOCUMENT: dict[str, Any] = json.loads((PUMP / "product.json").read_text())
COMPONENTS = {entry["id"]: entry for entry in DOCUMENT["components"]}
PLACED = {**COMPONENTS, **{entry["id"]: entry for entry in DOCUMENT["environment"]}}
OPERATIONS = {operation["active"][0]: operation for operation in DOCUMENT["operations"]}
CONTACT_MM3 = 0.01  # rounding of coordinates that touch
THICKNESS_MM, WIDTH_MM, PALM_RADIUS_MM, PALM_DEPTH_MM = 8.0, 10.0, 100.0, 200.0


@dataclass(frozen=True)
class Grip:
    """The grasp that a component is made for: fingers, W, L⁻ and, in the product frame, tips, axis and finger 1's angle."""

    fingers: int
    opening_mm: float
    length_min_mm: float
    tips_z_mm: float
    axis_mm: tuple[float, float] = (0.0, 0.0)
    turn_deg: float = 0.0


SHAFT, GEARS = (-220.0, 0.0), (220.0, 0.0)
GRIPS = {  # the tips 3 mm below the upper edge of what is held; L⁻ from there to the highest thing under the palm
    "coolant-cover": Grip(3, 124.9, 32 - 5, 5),
    "front-cover": Grip(3, 118, 42 - 15, 15),
    "rotor": Grip(3, 60.5, 74 - 47, 47),
    "carrier": Grip(3, 55, 104 - 79, 79),
    "inner-sleeve": Grip(3, 22, 34 - 7, 7, SHAFT),
    "shaft": Grip(3, 16.5, 74 - 51, 51, SHAFT),
    "gear-block": Grip(2, 24, 21 - 11, 11, (220, 58)),
    "sleeve": Grip(3, 19, 74 - 47, 47, SHAFT),
    "boss-block": Grip(2, 33, 36 - 9, 9, (220, -14)),
    "gear": Grip(3, 53, 39 - 17, 17, GEARS),
    "key": Grip(2, 4.4, 104 - 77, 77, (10, 0), 90),
    "nut": Grip(2, 19.8, 74 - 56, 56, SHAFT, 45),
    "flanged-sleeve": Grip(3, 14, 74 - 61, 61, SHAFT),
}


@cache
def mesh_of(name: str) -> trimesh.Trimesh:
    return trimesh.load_mesh(PUMP / PLACED[name]["file"])


@cache
def solid_of(name: str) -> manifold3d.Manifold:
    """The component in its place in the product."""
    mesh = mesh_of(name).copy().apply_transform(np.array(PLACED[name]["pose"]))
    solid = manifold3d.Manifold(manifold3d.Mesh64(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.uint64)))
    assert solid.status() == manifold3d.Error.NoError
    return solid


def hand(grip: Grip, finger_length_mm: float, sweep_mm: float = 0.0) -> Iterator[manifold3d.Manifold]:
    """Fingers (0.02 mm off, as touching) and a round palm at the end of the motion, drawn out upwards by `sweep_mm`."""
    height = finger_length_mm + sweep_mm
    finger = manifold3d.Manifold.cube([THICKNESS_MM, WIDTH_MM, height]).translate([grip.opening_mm / 2 + 0.02, -WIDTH_MM / 2, 0])
    palm = manifold3d.Manifold.cylinder(PALM_DEPTH_MM + sweep_mm, PALM_RADIUS_MM, PALM_RADIUS_MM, 60)
    place = [*grip.axis_mm, grip.tips_z_mm]
    for i in range(grip.fingers):
        yield finger.rotate([0, 0, grip.turn_deg + 360.0 * i / grip.fingers]).translate(place)
    yield palm.translate([0, 0, finger_length_mm]).translate(place)


def common_mm3(solids: Iterator[manifold3d.Manifold], others: list[str]) -> float:
    return float(sum((solid ^ solid_of(other)).volume() for solid in solids for other in others))


def obstacles_of(name: str) -> list[str]:
    return [*OPERATIONS[name]["passive"], "pallet"]


@pytest.mark.parametrize("name", PLACED)
def test_a_mesh_is_closed_and_encloses_the_volume_of_its_exact_model(name: str) -> None:
    mesh = mesh_of(name)
    reader, properties = STEPControl_Reader(), GProp_GProps()
    reader.ReadFile(str((PUMP / PLACED[name]["file"]).with_suffix(".step")))
    reader.TransferRoots()

    BRepGProp.VolumeProperties_s(reader.OneShape(), properties)

    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(properties.Mass(), rel=0.005)


def test_the_package_obeys_the_interface() -> None:
    manifest = read_manifest((PUMP / "product.json").read_bytes())

    assert (manifest.part_number, manifest.revision) == ("CP-1300", "A")
    assert [c.part_number for c in manifest.components] == [f"CP-{1301 + i}" for i in range(13)]
    assert [o.id for o in manifest.operations] == [f"op-{1 + i:02d}" for i in range(13)]
    assert all(is_rigid(np.array(entry["pose"])) for entry in PLACED.values())
    assert sum(not np.allclose(np.array(entry["pose"])[:3, :3], np.eye(3)) for entry in PLACED.values()) >= 4


def test_each_operation_finds_everything_placed_before_it() -> None:
    placed: list[str] = []
    for operation in DOCUMENT["operations"]:
        assert operation["passive"] == placed
        placed += operation["active"]

    assert placed == list(COMPONENTS)


def test_no_two_components_overlap_in_the_finished_product() -> None:
    overlaps = {pair: (solid_of(pair[0]) ^ solid_of(pair[1])).volume() for pair in combinations(PLACED, 2)}

    assert {pair: volume for pair, volume in overlaps.items() if volume > CONTACT_MM3} == {}


@pytest.mark.parametrize("name", COMPONENTS)
def test_a_component_meets_nothing_on_its_way(name: str) -> None:
    before, after = (np.array(OPERATIONS[name][key]) for key in ("pose_before", "pose_after"))
    assert np.allclose(before[:3, :3], np.eye(3))
    assert np.allclose(after, np.eye(4))

    for share in np.linspace(0.0, 1.0, 20):
        moved = solid_of(name).translate((1.0 - share) * before[:3, 3])
        assert common_mm3(iter([moved]), obstacles_of(name)) < CONTACT_MM3


@pytest.mark.parametrize("name", COMPONENTS)
def test_a_component_can_be_set_down_with_fingers_as_long_as_derived_by_hand(name: str) -> None:
    grip = GRIPS[name]
    lift = OPERATIONS[name]["pose_before"][2][3]

    long_enough = grip.length_min_mm + 0.1

    assert common_mm3(hand(grip, long_enough), [name]) < CONTACT_MM3
    assert common_mm3(hand(grip, long_enough, sweep_mm=lift), obstacles_of(name)) < CONTACT_MM3


@pytest.mark.parametrize("name", COMPONENTS)
def test_fingers_shorter_than_derived_by_hand_are_too_short(name: str) -> None:
    grip = GRIPS[name]

    assert common_mm3(hand(grip, grip.length_min_mm - 0.1), [name, *obstacles_of(name)]) > 1.0


@pytest.mark.parametrize("name", COMPONENTS)
def test_the_fingers_touch_what_they_are_made_for(name: str) -> None:
    grip = GRIPS[name]
    closed = Grip(grip.fingers, grip.opening_mm - 0.1, grip.length_min_mm, grip.tips_z_mm, grip.axis_mm, grip.turn_deg)

    *fingers, _ = hand(closed, grip.length_min_mm + 0.1)

    for finger in fingers:
        contact = finger ^ solid_of(name)
        assert contact.volume() > 0
        low, high = contact.bounding_box()[2], contact.bounding_box()[5]
        assert high - low == pytest.approx(3.0, abs=0.001)


def test_the_package_is_written_whole(tmp_path: Path) -> None:
    directory = samples.write_sample(tmp_path / "new" / "pump")

    assert sorted(file.name for file in directory.iterdir()) == sorted(file.name for file in PUMP.iterdir())
    assert (directory / "product.json").read_bytes() == (PUMP / "product.json").read_bytes()
