import base64
import json
import subprocess
import sys
import zlib

import numpy as np
import pytest

from gripwright.design.records import OwnTypes, dumps, loads, record_types
from gripwright.design.toolbox import record_classes
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Cylinder, Mesh

TYPES = record_types(record_classes())


def cylinder() -> Cylinder:
    return Cylinder(
        center_C=np.array([1.0, 2.0, 3.0]),
        axis_C=np.array([0.0, 0.0, 1.0]),
        radius_mm=5.0,
        height_mm=np.inf,
        internal=True,
        arc_rad=1.0,
        rms_mm=0.0,
        surface_filled=False,
    )


def test_what_was_stored_comes_back_with_its_types_and_bits() -> None:
    value = {"fit": cylinder(), 3: (1, 2.5, None, True), "list": [Rejection("a", "b")], "bytes": b"\x00\xff", "nan": float("nan")}

    back = loads(dumps(value), TYPES)

    assert isinstance(back["fit"], Cylinder)
    assert (back["fit"].center_C == cylinder().center_C).all()
    assert back["fit"].height_mm == np.inf
    assert back[3] == (1, 2.5, None, True)
    assert back["list"] == [Rejection("a", "b")]
    assert back["bytes"] == b"\x00\xff"
    assert np.isnan(back["nan"])


def test_the_same_value_gives_the_same_bytes() -> None:
    mesh = Mesh(vertices_mm=np.random.default_rng(1).normal(size=(50, 3)), faces=np.arange(48).reshape(-1, 3))

    assert dumps(mesh) == dumps(loads(dumps(mesh), TYPES))


def test_arrays_come_back_aligned_with_their_types_and_cannot_be_written_to() -> None:
    arrays = [
        np.arange(5, dtype=np.int64),
        np.array([[2**40, -1]]),
        np.array([2**31 - 1, -(2**31)]),
        np.array([2**31]),
        np.zeros((0, 3), dtype=np.int64),
        np.float32([0.1, np.nan]),
        np.array([True, False, True]),
        np.arange(12.0).reshape(3, 4).T,
        np.array(7.5),
    ]

    back = loads(dumps(["odd", b"odd", *arrays]), TYPES)[2:]

    for one, other in zip(arrays, back, strict=True):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
        assert other.flags.aligned
        assert not other.flags.writeable


def test_a_record_of_the_first_form_still_loads() -> None:
    def base64_of(array: np.ndarray) -> str:
        return base64.b64encode(array.tobytes()).decode()

    mesh = Mesh(vertices_mm=np.eye(3), faces=np.array([[0, 1, 2]]))
    arrays = {
        "vertices_mm": {"$array": ["<f8", [3, 3], base64_of(mesh.vertices_mm)]},
        "faces": {"$array": ["<i8", [1, 3], base64_of(mesh.faces)]},
    }  # from before meshes had `cad_faces`
    node = {"$tuple": [{"$type": "gripwright.domain.shape:Mesh", "fields": arrays}, {"$bytes": "AP8="}]}

    back, other = loads(zlib.compress(json.dumps(node).encode()), TYPES)

    assert back.cad_faces is None
    assert np.array_equal(back.vertices_mm, mesh.vertices_mm)
    assert np.array_equal(back.faces, mesh.faces)
    assert other == b"\x00\xff"


def test_a_record_builds_nothing_but_known_dataclasses() -> None:
    hostile = zlib.compress(json.dumps({"$type": "os:system", "fields": {"command": "true"}}).encode())

    with pytest.raises(ValueError, match="os:system"):
        loads(hostile, TYPES)


def test_what_no_record_can_hold_is_refused_when_it_is_written() -> None:
    with pytest.raises(TypeError, match="set"):
        dumps({"a": {1, 2}})


def test_the_domains_own_types_are_found_by_their_names_alone() -> None:
    assert {name: OwnTypes()[name] for name in TYPES} == dict(TYPES)


@pytest.mark.parametrize(
    "name",
    [
        "os:system",
        "subprocess:Popen",
        "gripwright.design.records:dumps",
        "gripwright.design.records:Mapping",
        "gripwright.design.none:X",
    ],
)
def test_a_name_of_anything_else_is_no_type(name: str) -> None:
    with pytest.raises(KeyError):
        OwnTypes()[name]


def test_stages_can_be_named_without_the_calculation() -> None:
    program = (
        "import sys; from gripwright.jobs.stages import STAGES; print(*(set(sys.modules) & {'scipy', 'numba', 'OCP', 'fcl'}))"
    )

    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)

    assert loaded.stdout.split() == []
