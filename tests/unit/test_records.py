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


def test_a_mesh_stored_before_meshes_had_cad_faces_still_loads() -> None:
    mesh = Mesh(vertices_mm=np.eye(3), faces=np.array([[0, 1, 2]]))
    node = json.loads(zlib.decompress(dumps(mesh)))
    del node["fields"]["cad_faces"]

    back = loads(zlib.compress(json.dumps(node).encode()), TYPES)

    assert back.cad_faces is None
    assert np.array_equal(back.vertices_mm, mesh.vertices_mm)


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
