"""Written files read back, are the same each time, and carry names, units and colours."""

import io
import json
import struct
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import trimesh

from gripwright.cad.colour import component_glb, linear_colours, segment_colours, value_colours
from gripwright.cad.export import step_bytes, stl_bytes, threemf_bytes
from gripwright.cad.glb import GlbPart, glb_bytes
from gripwright.cad.limits import DEFAULT_LIMITS
from gripwright.cad.read import read_mesh
from gripwright.cad.step import read_step_assembly
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import Mesh
from gripwright.geometry.brep import box, cut, cylinder_z, measure, tessellate, write_brep
from gripwright.geometry.frames import rotation_z
from gripwright.geometry.measures import volume_mm3

SOLID = cut(box((0, 0, 0), (12, 20, 30)), [cylinder_z(6, 10, 3.3, -1, 31)])


def _mesh() -> Mesh:
    return tessellate(SOLID)


def test_step_is_ap242_in_mm_with_the_products_identity_and_the_exact_solid() -> None:
    data = step_bytes(write_brep(SOLID), name="Finger Ø 'x'", part_number="G1-F", description="straight finger")

    assert b"AP242" in data
    assert b"SI_UNIT(.MILLI.,.METRE.)" in data
    assert b"PRODUCT('G1-F'," in data
    assert b"'straight finger'" in data
    assert data.isascii()
    assembly = read_step_assembly(data, DEFAULT_LIMITS)
    assert assembly.name == "Finger Ø 'x'"
    assert volume_mm3(assembly.meshes[0]) == pytest.approx(measure(SOLID).volume_mm3, rel=1e-3)


def test_bytes_that_are_no_solid_are_refused() -> None:
    with pytest.raises(InvalidGeometry):
        step_bytes(b"nonsense", name="x", part_number="y")


def test_step_has_no_time_and_is_the_same_in_another_process() -> None:
    script = (
        "import sys; from gripwright.cad.export import step_bytes; "
        "sys.stdout.buffer.write(step_bytes(sys.stdin.buffer.read(), name='finger', part_number='F'))"
    )
    brep = write_brep(SOLID)
    elsewhere = subprocess.run([sys.executable, "-c", script], input=brep, stdout=subprocess.PIPE, check=True).stdout

    first, second = (step_bytes(brep, name="finger", part_number="F") for _ in range(2))

    assert first == second == elsewhere  # nothing else on standard output either


@pytest.mark.parametrize("format", ["stl", "3mf"])
def test_a_mesh_survives_writing_and_reading(format: str) -> None:
    mesh = _mesh()
    data = stl_bytes(mesh) if format == "stl" else threemf_bytes(mesh, 'a <"name">')

    read = read_mesh(data, format, "mm" if format == "stl" else None)

    assert read.triangles_mm == pytest.approx(mesh.triangles_mm, abs=1e-5)
    assert trimesh.Trimesh(read.vertices_mm, read.faces, process=False).is_watertight
    assert data == (stl_bytes(mesh) if format == "stl" else threemf_bytes(mesh, 'a <"name">'))


def test_a_glb_is_in_metres_and_places_its_parts() -> None:
    X = rotation_z(np.pi / 2)
    X[:3, 3] = [100, 0, 0]
    mesh = _mesh()

    data = glb_bytes([GlbPart(name="one", mesh=mesh, colour=(1.0, 0.0, 0.0)), GlbPart(name="two", mesh=mesh, X=X)])

    scene = trimesh.load_scene(io.BytesIO(data), file_type="glb")
    assert set(scene.graph.nodes_geometry) == {"one", "two"}
    assert scene.graph["two"][0][:3, 3] == pytest.approx([0.1, 0, 0])
    assert scene.graph["two"][0][:3, :3] == pytest.approx(X[:3, :3])
    assert volume_mm3(read_mesh(data, "glb", None)) == pytest.approx(2 * volume_mm3(mesh), rel=1e-5)
    assert data == glb_bytes([GlbPart(name="one", mesh=mesh, colour=(1.0, 0.0, 0.0)), GlbPart(name="two", mesh=mesh, X=X)])


def test_a_glb_keeps_to_the_container_format() -> None:
    data = component_glb("ö", _mesh())

    magic, version, length = struct.unpack("<4sII", data[:12])
    document_length, kind = struct.unpack("<I4s", data[12:20])
    document = _document(data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    assert document_length % 4 == 0
    assert all(view["byteOffset"] % 4 == 0 for view in document["bufferViews"])
    assert document["buffers"][0]["byteLength"] == len(data) - 28 - document_length


def test_a_coloured_component_shows_each_face_in_its_segments_colour() -> None:
    mesh = _mesh()
    labels = np.arange(len(mesh.faces)) % 3

    data = component_glb("c", mesh, segment_colours(labels))

    primitive = _document(data)["meshes"][0]["primitives"][0]
    corners = _accessor(data, primitive["indices"], "<u4").reshape(-1, 3)  # (m, corner)
    positions = _accessor(data, primitive["attributes"]["POSITION"], "<f4").reshape(-1, 3)
    colours = _accessor(data, primitive["attributes"]["COLOR_0"], "<f4").reshape(-1, 3)
    assert positions[corners] * 1000 == pytest.approx(mesh.triangles_mm, abs=1e-4)
    assert colours[corners] == pytest.approx(np.repeat(linear_colours(segment_colours(labels))[:, None], 3, axis=1), abs=1e-6)
    assert len(np.unique(np.hstack([positions, colours]), axis=0)) == len(positions)  # faces of one colour share vertices


def _document(data: bytes) -> dict[str, Any]:
    (length,) = struct.unpack("<I", data[12:16])
    document: dict[str, Any] = json.loads(data[20 : 20 + length])
    return document


def _accessor(data: bytes, number: int, dtype: str) -> np.ndarray:
    (length,) = struct.unpack("<I", data[12:16])
    document = _document(data)
    view = document["bufferViews"][document["accessors"][number]["bufferView"]]
    return np.frombuffer(data, dtype, view["byteLength"] // 4, 28 + length + view["byteOffset"])


def test_forty_segments_have_forty_colours_within_the_range() -> None:
    colours = segment_colours(np.arange(40))

    assert len(np.unique(colours.round(2), axis=0)) == 40
    assert ((colours >= 0) & (colours <= 1)).all()
    assert (np.abs(np.diff(colours[:32], axis=0)).sum(axis=1) > 0.15).all()


def test_values_run_from_dark_to_bright_and_what_is_no_number_is_black() -> None:
    colours = value_colours(np.array([1.0, 2.0, 3.0, np.nan]))

    brightness = colours.sum(axis=1)
    assert brightness[3] == 0
    assert (np.diff(brightness[:3]) > 0).all()
    assert np.isfinite(value_colours(np.full(4, 7.0))).all()
