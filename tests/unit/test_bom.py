"""The bill of materials."""

import csv
import dataclasses
import io
from typing import Any

import numpy as np
import pytest

from gripwright.design.bom_forms import FLAT, LEVELS, bom_csv, bom_flat, bom_row, bom_views
from gripwright.design.stages.bom import COLUMNS, BomRow, bom, finger_part_number
from gripwright.domain.assembly import AssemblyTask, Operation
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, Grasp, Hold
from gripwright.domain.gripper import Actuator, BondedFinger, FingerDesign, Gripper, Handle, MadePart
from gripwright.domain.shape import Mesh

ACTUATOR = Actuator(maker="SMC", model="MHSL3-32D", gripper_type=CENTRIC_3, stroke_mm=16.0, mass_kg=0.37)
PROPERTIES = {"bolt_thread_mm": 4.0, "base_thickness_mm": 10.0, "pin_hole_mm": 3.0}


def make_task() -> AssemblyTask:
    made = tuple(Operation(id=op, active=("c",), passive=(), motion=np.stack([np.eye(4)] * 2)) for op in ("op-2", "op-1"))
    return AssemblyTask(part_number="CP-1300", revision="A", name="", components=(), obstacles=(), operations=made)


def make_gripper(gripper_id: str = "G1", *operations: str) -> Gripper:
    grasp = Grasp(X_CG=np.eye(4), gripper_type=CENTRIC_3, grip=EXTERNAL, opening_width_mm=20.0)
    handles = tuple(
        Handle(
            operation=operation,
            component="c",
            segment=0,
            opening_width_mm=20.0,
            release_opening_mm=21.0,
            grasp=grasp,
            gap_mm=1.0,
            hold=Hold(required_force_N=1.0, moment_Nmm=0.0, symmetry=1.0),
            safety_factor=None,
        )
        for operation in operations
    )
    return Gripper(
        id=gripper_id,
        gripper_type=CENTRIC_3,
        fingers=3,
        grip=EXTERNAL,
        opening_min_mm=5.0,
        opening_max_mm=21.0,
        finger_length_mm=30.0,
        actuator=ACTUATOR,
        jaw_offset_mm=0.0,
        envelope_mm=40.0,
        handles=handles,
    )


def make_finger(**changes: Any) -> FingerDesign:
    vertices = np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, -30.0]])
    mesh = Mesh(vertices_mm=vertices, faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    figures: dict[str, Any] = {"brep": b"", "mesh": mesh, "material": "EN AW-6082", "volume_mm3": 400.0, "mass_kg": 0.00108}
    return FingerDesign(**{**figures, "properties": PROPERTIES, **changes})


def make_padded(**changes: Any) -> FingerDesign:
    finger, pad = make_finger(**changes), make_finger().mesh
    bare = MadePart(brep=b"", mesh=finger.mesh, material=finger.material, mass_kg=0.001)
    strip = MadePart(brep=b"", mesh=pad, material="NBR 70 Shore A", mass_kg=0.0004)
    return dataclasses.replace(finger, bonded=BondedFinger(bare=bare, pad=strip, pad_size_mm=(1.5, 10.0, 30.0), adhesive="glue"))


def make_rows() -> list[BomRow]:
    return bom(make_task(), [make_gripper("G1", "op-1", "op-2")], {"G1": make_finger()}, {})


def test_a_gripper_is_an_actuator_fingers_screws_and_pins() -> None:
    rows = make_rows()

    assert [(row.item, row.make_or_buy, row.quantity) for row in rows] == [
        ("actuator", "buy", 1),
        ("finger", "make", 3),
        ("screw", "buy", 6),
        ("pin", "buy", 3),
    ]
    assert (rows[0].maker, rows[0].model, rows[0].mass_kg) == ("SMC", "MHSL3-32D", 0.37)
    assert (rows[1].material, rows[1].mass_kg) == ("EN AW-6082", 0.00108)
    assert "grippers/G1/finger.step" in rows[1].files


def test_a_pad_is_an_item_of_its_own_and_the_finger_is_made_without_it() -> None:
    rows = bom(make_task(), [make_gripper("G1", "op-1")], {"G1": make_padded()}, {})

    assert [row.item for row in rows] == ["actuator", "finger", "pad", "screw", "pin"]
    finger, pad = rows[1], rows[2]
    assert (finger.mass_kg, finger.files[0]) == (0.001, "grippers/G1/finger_bare.step")
    assert (pad.quantity, pad.make_or_buy, pad.material, pad.mass_kg) == (3, "make", "NBR 70 Shore A", 0.0004)
    assert "bond to the finger over its whole face with glue" in pad.description
    assert pad.files == ("grippers/G1/pad.step", "grippers/G1/pad.stl")
    assert pad.part_number.startswith("GW-P-")


def test_fingers_of_other_shape_share_the_part_number_of_their_pad() -> None:
    longer = make_finger().mesh.vertices_mm * [1.0, 1.0, 1.01]
    fingers = {"G1": make_padded(), "G2": make_padded(mesh=Mesh(vertices_mm=longer, faces=make_finger().mesh.faces))}

    rows = bom_flat(bom(make_task(), [make_gripper("G1", "op-1"), make_gripper("G2", "op-2")], fingers, {}))

    assert [(row.item, row.quantity) for row in rows] == [
        ("actuator", 2),
        ("finger", 3),
        ("pad", 6),
        ("screw", 12),
        ("pin", 6),
        ("finger", 3),
    ]


def test_operations_stand_in_the_order_of_the_sequence() -> None:
    assert make_rows()[0].operations == ("op-2", "op-1")


def test_screws_are_long_enough_for_the_base_and_the_thread() -> None:
    designation = make_rows()[2].model  # clamps 10 − 4.5 mm, 4.8 mm of thread at least

    assert designation == "ISO 4762 M4x12-8.8"


def test_a_finger_that_states_no_base_gets_the_documented_screw() -> None:
    rows = bom(make_task(), [make_gripper()], {"G1": make_finger(properties={})}, {})

    assert [row.model for row in rows[2:]] == ["ISO 4762 M4x16-8.8"]


def test_a_gripper_whose_finger_cannot_be_made_has_its_actuator_alone() -> None:
    assert [row.item for row in bom(make_task(), [make_gripper()], {}, {})] == ["actuator"]


def test_a_part_number_depends_on_shape_and_material_alone() -> None:
    finger = make_finger()
    reordered = Mesh(vertices_mm=finger.mesh.vertices_mm, faces=finger.mesh.faces[::-1])
    longer = Mesh(vertices_mm=finger.mesh.vertices_mm * [1.0, 1.0, 1.01], faces=finger.mesh.faces)

    number = finger_part_number(finger)

    assert number == finger_part_number(make_finger(mass_kg=1.0, mesh=reordered))
    assert number != finger_part_number(make_finger(mesh=longer))
    assert number != finger_part_number(make_finger(material="PA12"))
    assert number.startswith("GW-F-")


def test_the_csv_has_a_row_an_item_and_reads_back() -> None:
    rows = make_rows()

    table = list(csv.DictReader(io.StringIO(bom_csv([row.to_dict() for row in rows]))))

    assert tuple(table[0]) == COLUMNS
    assert len(table) == len(rows)
    assert table[0]["operations"] == "op-2; op-1"
    assert table[2]["mass_kg"] == ""


DESIGN = {
    "product": {"part_number": "CP-1300", "revision": "A"},
    "operations": [{"id": "op-2"}, {"id": "op-1"}],
}


def make_levels(**changes: Any) -> list[dict[str, Any]]:
    grippers = [make_gripper("G1", "op-1", "op-2"), make_gripper("G2", "op-1"), make_gripper("G3", "op-2")]
    fingers = {"G1": make_finger(**changes), "G2": make_finger()}
    return bom_views(DESIGN, bom(make_task(), grippers, fingers, {"G3": "old"}))[LEVELS][1]


def test_the_multi_level_bill_is_a_set_of_grippers_of_items() -> None:
    levels = make_levels()

    assert [(row["level"], row["gripper"], row["item"], row["make_or_buy"]) for row in levels] == [
        (0, "", "gripper set", "assemble"),
        (1, "G1", "gripper", "assemble"),
        (2, "G1", "actuator", "buy"),
        (2, "G1", "finger", "make"),
        (2, "G1", "screw", "buy"),
        (2, "G1", "pin", "buy"),
        (1, "G2", "gripper", "assemble"),
        (2, "G2", "actuator", "buy"),
        (2, "G2", "finger", "make"),
        (2, "G2", "screw", "buy"),
        (2, "G2", "pin", "buy"),
        (1, "G3", "gripper", "owned"),
    ]
    for i, row in enumerate(levels[1:], 1):
        above = next(other for other in reversed(levels[:i]) if other["level"] == row["level"] - 1)
        assert row["parent"] == above["part_number"]


def test_assemblies_have_numbers_that_change_with_their_parts_alone() -> None:
    first, again, changed = make_levels(), make_levels(), make_levels(material="PA12")

    assert first == again
    assert first[1]["part_number"] == first[6]["part_number"]  # the same parts
    assert [a["part_number"] != b["part_number"] for a, b in zip(first, changed, strict=True)] == [
        row["item"] in ("gripper set", "gripper", "finger") and row["gripper"] in ("", "G1") for row in first
    ]


def test_an_assembly_weighs_what_its_parts_do_where_all_are_known() -> None:
    alone = bom(make_task(), [make_gripper("G1")], {}, {})

    levels = bom_views(DESIGN, alone)[LEVELS][1]

    assert (levels[1]["mass_kg"], make_levels()[1]["mass_kg"]) == (0.37, None)  # the mass of screws is not known


def test_operations_stand_in_the_order_of_the_sequence_in_every_form() -> None:
    rows = bom(make_task(), [make_gripper("G1", "op-1"), make_gripper("G2", "op-2")], {}, {})

    forms = bom_views(DESIGN, rows)

    assert forms[FLAT][1][0]["operations"] == forms[LEVELS][1][0]["operations"] == ["op-2", "op-1"]


def test_a_row_is_the_same_from_its_json_values() -> None:
    assert [bom_row(row.to_dict()) for row in make_rows()] == make_rows()


def test_every_item_says_in_which_operations_it_is_used() -> None:
    assert {row.operations for row in make_rows()} == {("op-2", "op-1")}


def test_totals_join_equal_parts_of_several_grippers() -> None:
    fingers = {"G1": make_finger(), "G2": make_finger()}
    rows = bom(make_task(), [make_gripper("G1", "op-1"), make_gripper("G2", "op-2")], fingers, {})

    joined = bom_flat(rows)

    assert [(row.item, row.quantity, row.gripper) for row in joined] == [
        ("actuator", 2, "G1; G2"),
        ("finger", 6, "G1; G2"),
        ("screw", 12, "G1; G2"),
        ("pin", 6, "G1; G2"),
    ]
    assert dataclasses.replace(joined[0], gripper="G1", quantity=1, operations=("op-1",), files=rows[0].files) == rows[0]


@pytest.mark.parametrize("model", ["=1+1", "+49", "-C-12", "@SUM"])
def test_no_spreadsheet_takes_a_cell_for_a_formula(model: str) -> None:
    rows = [dataclasses.replace(make_rows()[0], model=model).to_dict()]

    assert f",'{model}," in bom_csv(rows)
