"""A STEP file that Open CASCADE reads in part is refused (cad/step_whole.py)."""

import re
from pathlib import Path

import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus

from gripwright.cad.export import step_bytes
from gripwright.cad.limits import DEFAULT_LIMITS
from gripwright.cad.step import read_step_assembly
from gripwright.domain.errors import InvalidGeometry
from gripwright.geometry.brep import box, cut, cylinder_z, together, write_brep
from gripwright.geometry.measures import volume_mm3

SAMPLES = Path(__file__).resolve().parents[2] / "service" / "gripwright" / "samples" / "pump"


def _step(shape) -> str:
    return step_bytes(write_brep(shape), name="part", part_number="P-1").decode()


def _block() -> str:
    """A block with a bore: seven faces, five of them with one bound."""
    return _step(cut(box((0, 0, 0), (40, 30, 20)), [cylinder_z(20, 15, 8, -1, 21)]))


@pytest.mark.parametrize(
    ("pattern", "replacement", "reason"),
    [
        (r"(#\d+) = ADVANCED_FACE\('',\((#\d+)\),#\d+", r"\1 = ADVANCED_FACE('',(\1),\1", "5 of its 7 faces"),
        (r"#\d+ = EDGE_CURVE\([^;]*;", "", "structure: 2, the first is: Unresolved Reference"),
        (r"CLOSED_SHELL\('',\((#\d+),", r"CLOSED_SHELL('',(", "6 of its 7 faces"),
        (r"#\d+ = MANIFOLD_SOLID_BREP\([^;]*;", "", "structure: 1, the first is"),
    ],
    ids=["faces of themselves", "an edge is not there", "a face that no shell holds", "the solid is not there"],
)
def test_a_step_file_of_which_a_part_cannot_be_read_is_refused_with_how_much(pattern, replacement, reason) -> None:
    broken = re.sub(pattern, replacement, _block(), count=0 if "ADVANCED" in pattern else 1)

    with pytest.raises(InvalidGeometry, match=reason):
        read_step_assembly(broken.encode(), DEFAULT_LIMITS)


def test_a_face_that_open_cascade_leaves_out_is_counted() -> None:
    broken = re.sub(r"(CYLINDRICAL_SURFACE\('',#\d+),8\.", r"\1,-8.", _block())

    with pytest.raises(InvalidGeometry, match="6 of its 7 faces, the first failure is: Surface has not been created"):
        read_step_assembly(broken.encode(), DEFAULT_LIMITS)


def test_a_file_without_a_unit_of_length_is_not_taken_for_one_in_mm() -> None:
    broken = _block().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.MILLI.,.GRAM.)").replace("LENGTH_UNIT", "MASS_UNIT")

    with pytest.raises(InvalidGeometry, match="states no unit of length"):
        read_step_assembly(broken.encode(), DEFAULT_LIMITS)


@pytest.mark.parametrize(
    "shape",
    [
        BRepPrimAPI_MakeSphere(20.0).Shape(),
        BRepPrimAPI_MakeTorus(20.0, 5.0).Shape(),
        cylinder_z(0, 0, 5, 0, 10),
        together([box((0, 0, 0), (1, 2, 3)), box((5, 0, 0), (6, 2, 3)), box((6, 0, 0), (7, 2, 3))]),
    ],
    ids=["sphere", "torus", "cylinder", "three solids"],
)
def test_closed_surfaces_and_several_solids_are_read_whole(shape) -> None:
    assembly = read_step_assembly(_step(shape).encode(), DEFAULT_LIMITS)

    assert all(volume_mm3(mesh) > 0 for mesh in assembly.meshes)


def test_the_samples_are_read_whole() -> None:
    files = sorted(SAMPLES.glob("*.step"))

    assert len(files) >= 10
    for path in files:
        assert read_step_assembly(path.read_bytes(), DEFAULT_LIMITS).meshes, path.name
