import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from gripwright.design.gripper_assembly import BodyMeasures
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2
from gripwright.domain.gripper import Actuator, BondedFinger, FingerDesign, FingerSpec, MadePart
from gripwright.geometry import brep
from gripwright.report.dimension import horizontal, millimetres, vertical
from gripwright.report.drawing import finger_drawing

SVG = "{http://www.w3.org/2000/svg}"


def make_cad(*, length_mm: float = 30.0, base_length_mm: float = 40.0, material: str = "PA12") -> GripperCad:
    """A stem of 8 × 10 on a base of 12 × 26, with two screw holes 17 mm apart and a pin hole."""
    back, front = -length_mm - 12.0, -length_mm
    x = 8.0 - base_length_mm + 6.0
    base = brep.box((8.0 - base_length_mm, -13.0, back), (8.0, 13.0, front))
    holes = [brep.cylinder_z(x, y, 1.7, back - 1, front + 1) for y in (-8.5, 8.5)]
    bores = [brep.cylinder_z(x, y, 3.0, front - 3.5, front + 1) for y in (-8.5, 8.5)]
    pin = brep.cylinder_z(x, 0.0, 1.5, back - 1, back + 6.0)
    shape = brep.fuse(brep.cut(base, [*holes, *bores, pin]), brep.box((0.0, -5.0, front - 1.0), (8.0, 5.0, 0.0)))
    actuator = Actuator(maker="A & B", model="<M1>", gripper_type=PARALLEL_2, stroke_mm=10.0)
    spec = FingerSpec(
        gripper_type=PARALLEL_2,
        grip=EXTERNAL,
        finger_length_mm=length_mm,
        jaw_offset_mm=base_length_mm - 8.0,
        opening_min_mm=100.0,
        opening_max_mm=110.0,
        stroke_mm=10.0,
        fingers=2,
        envelope_mm=70.0,
        actuator=actuator,
        contact_radii_mm=(),
        grip_force_N=50.0,
    )
    finger = FingerDesign(
        brep=brep.write_brep(shape),
        mesh=brep.tessellate(shape),
        material=material,
        volume_mm3=brep.measure(shape).volume_mm3,
        mass_kg=0.0123,
        properties={"deflection_mm": 0.214, "finger_force_N": 25.0},
    )
    return GripperCad(
        spec=spec,
        finger=finger,
        body_brep=b"",
        body=finger.mesh,
        measures=BodyMeasures(front_mm=back, diameter_mm=50.0, length_mm=60.0),
    )


def words(svg: str) -> list[str]:
    return [element.text or "" for element in ElementTree.fromstring(svg).iter(f"{SVG}text")]


def test_the_drawing_states_the_fingers_main_dimensions() -> None:
    stated = words(finger_drawing(make_cad(), title="Finger", part_number="F-1"))

    for value in ("30", "42", "12", "8", "10", "40", "26", "17", "26"):
        assert value in stated


def test_the_drawing_lists_the_holes_by_kind_with_how_many_there_are() -> None:
    stated = words(finger_drawing(make_cad(), title="Finger", part_number="F-1"))

    assert "A: 2 × ⌀3.4 through, ⌀6 × 3.5 deep from the front" in stated
    assert "B: 1 × ⌀3 × 6 deep from the back" in stated
    assert (stated.count("A"), stated.count("B")) == (2, 1)


def test_a_force_limit_is_on_the_drawing() -> None:
    svg = finger_drawing(replace(make_cad(), grip_force_max_N=120.0), title="Finger", part_number="F-1")

    assert "Regulate the actuator to 120 N at most." in words(svg)


def test_a_pad_is_drawn_on_its_seat_from_which_the_holes_are_measured() -> None:
    cad = make_cad()
    pad = brep.box((0.0, -5.0, -30.0), (1.5, 5.0, 0.0))
    bare = brep.cut(brep.read_brep(cad.finger.brep), [pad])
    parts = [
        MadePart(brep=brep.write_brep(shape), mesh=brep.tessellate(shape), material=name, mass_kg=0.01)
        for shape, name in ((bare, "PA12"), (pad, "NBR 70 Shore A"))
    ]
    padded = replace(
        cad,
        finger=replace(
            cad.finger, bonded=BondedFinger(bare=parts[0], pad=parts[1], pad_size_mm=(1.5, 10.0, 30.0), adhesive="glue")
        ),
    )

    stated = words(finger_drawing(padded, title="Finger", part_number="F-1"))

    assert "1.5" in stated
    assert ("26" in stated, "27.5" in stated) == (True, True)  # the base's width, and the holes, 26 from x = 0
    assert "PA12; pad NBR 70 Shore A" in stated
    assert any(line.startswith("Pad: NBR 70 Shore A, 1.5 × 10 × 30; bond it") for line in stated)


def test_a_round_gripping_surface_is_drawn_with_its_radius() -> None:
    cad = make_cad()
    round_ = replace(cad, finger=replace(cad.finger, properties={**cad.finger.properties, "nose_radius_mm": 4.5}))

    stated = words(finger_drawing(round_, title="Finger", part_number="F-1"))

    assert "R4.5" in stated
    assert any("round side R4.5" in line for line in stated)
    assert not any("flat over" in line for line in stated)


def test_names_from_outside_cannot_break_the_drawing() -> None:
    stated = words(finger_drawing(make_cad(), title="<script>&", part_number='"F"'))

    assert {"<script>&", '"F"', "Make 2 alike, one for each jaw of A & B/<M1>."} <= set(stated)


@pytest.mark.parametrize(("length_mm", "base_length_mm"), [(5.0, 20.0), (30.0, 40.0), (120.0, 90.0), (165.0, 200.0)])
def test_views_stay_inside_the_sheet_and_left_of_the_notes(length_mm: float, base_length_mm: float) -> None:
    svg = finger_drawing(make_cad(length_mm=length_mm, base_length_mm=base_length_mm), title="Finger", part_number="F-1")

    drawn = [path.get("d") or "" for path in ElementTree.fromstring(svg).iter(f"{SVG}path")]
    points = np.array([[float(n) for n in pair.split()] for d in drawn for pair in re.split("[MLZ]", d) if pair])
    assert points.min() >= 10.0
    assert points[:, 0].max() <= 297.0 - 10.0 - 120.0
    assert points[:, 1].max() <= 200.0


def test_the_same_finger_gives_the_same_drawing() -> None:
    drawings = {finger_drawing(make_cad(), title="Finger", part_number="F-1") for _ in range(2)}

    assert len(drawings) == 1


@pytest.mark.parametrize(("value", "stated"), [(30.0, "30"), (34.45, "34.45"), (9.999, "10"), (0.5, "0.5"), (100.0, "100")])
def test_lengths_have_at_most_two_decimals(value: float, stated: str) -> None:
    assert millimetres(value) == stated


def test_a_dimension_without_room_has_its_arrows_outside() -> None:
    def line_length(svg: str) -> float:
        line = list(ElementTree.fromstring(f"<g>{svg}</g>").iter("line"))[-1]
        return float(line.get("x2", 0)) - float(line.get("x1", 0))

    assert line_length(horizontal((0.0, 0.0), (20.0, 0.0), 5.0, 20.0)) == pytest.approx(20.0)
    assert line_length(horizontal((0.0, 0.0), (3.0, 0.0), 5.0, 3.0)) > 3.0


def test_a_vertical_dimension_lies_beside_the_outermost_point() -> None:
    lines = list(ElementTree.fromstring(f"<g>{vertical((4.0, 0.0), (9.0, 10.0), 5.0, 10.0)}</g>").iter("line"))

    assert float(lines[-1].get("x1", 0)) == pytest.approx(14.0)
