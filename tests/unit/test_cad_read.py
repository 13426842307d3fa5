"""Every format: volume, units and the file's order of faces survive reading."""

import io
import struct
import zipfile

import numpy as np
import pytest
import trimesh

from gripwright.cad.export import step_bytes, stl_bytes, threemf_bytes
from gripwright.cad.formats import format_of
from gripwright.cad.read import read_mesh
from gripwright.domain.errors import InvalidGeometry, InvalidInput
from gripwright.domain.shape import Mesh
from gripwright.geometry.brep import box, cut, cylinder_z, fuse, measure, write_brep
from gripwright.geometry.codec import MM_PER_UNIT, mesh_in_mm
from gripwright.geometry.measures import face_centres_mm, volume_mm3

UNITLESS = ("stl", "obj", "ply", "off")


def _shuffled_ring() -> trimesh.Trimesh:
    """A closed ring whose faces stand in a random order, so that reordering shows."""
    ring = trimesh.creation.annulus(r_min=5.0, r_max=12.5, height=7.0, sections=24)
    order = np.random.default_rng(7).permutation(len(ring.faces))
    return trimesh.Trimesh(ring.vertices, ring.faces[order], process=False)


def _file(ring: trimesh.Trimesh, format: str) -> bytes:
    data = ring.export(file_type=format)
    return data.encode() if isinstance(data, str) else data


@pytest.mark.parametrize("format", UNITLESS)
@pytest.mark.parametrize("units", ["mm", "cm", "m", "in"])
def test_a_mesh_file_keeps_its_faces_in_order_and_its_volume_in_the_stated_unit(format: str, units: str) -> None:
    ring = _shuffled_ring()

    mesh = read_mesh(_file(ring, format), format, units)

    scale = MM_PER_UNIT[units]
    assert volume_mm3(mesh) == pytest.approx(ring.volume * scale**3, rel=1e-6)
    assert face_centres_mm(mesh) == pytest.approx(ring.triangles_center * scale, abs=1e-5 * scale)
    assert len(mesh.vertices_mm) == len(ring.vertices)


def test_an_ascii_stl_of_two_solids_keeps_the_order_of_its_faces() -> None:
    first, second = _shuffled_ring(), trimesh.creation.box([3, 4, 5])
    text = trimesh.exchange.stl.export_stl_ascii(first) + "\n" + trimesh.exchange.stl.export_stl_ascii(second)

    mesh = read_mesh(text.encode(), "stl", "mm")

    assert face_centres_mm(mesh) == pytest.approx(np.concatenate([first.triangles_center, second.triangles_center]), abs=1e-5)


def test_an_stl_with_a_binary_header_that_says_solid_or_with_data_appended_is_read() -> None:
    ring = _shuffled_ring()
    data = _file(ring, "stl")

    for variant in (b"solid" + data[5:], data + b"appended"):
        assert volume_mm3(read_mesh(variant, "stl", "mm")) == pytest.approx(ring.volume, rel=1e-6)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (_file(_shuffled_ring(), "stl")[:-1], "ends early: it declares 192 triangles"),
        (b"solid x\n facet\n outer loop\n vertex 1 2 3\n vertex 1 2 3\n endloop\n", "1 facets with 2 vertices"),
        (b"solid x\n vertex 1 2 3\n vertex 1 x 3\n vertex 1 2 3\n endloop\nendsolid", "'x' is no number"),
        (b"solid x\n vertex 1 2 3\n vertex 1 1 3\n vertex 1 2 3\n endloop\n", "after 1 facets there is no endsolid"),
        (b"", "ends early"),
    ],
)
def test_an_stl_that_is_cut_off_or_garbled_is_refused(data: bytes, reason: str) -> None:
    with pytest.raises(InvalidGeometry, match=reason):
        read_mesh(data, "stl", "mm")


def test_polygons_of_an_obj_become_fans_in_the_files_order_whatever_its_groups_and_materials() -> None:
    text = b"""mtllib none.mtl
v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nv 5 5 8
g base
usemtl steel
f 4/1/1 3/1/1 2/1/1 1/1/1
g sides
usemtl brass
f 1 2 5
f -4 -3 -1
f 3 4 5 \\
\nf 4//2 1//2 5//2
"""
    mesh = read_mesh(text, "obj", "mm")

    assert len(mesh.faces) == 6
    assert volume_mm3(mesh) == pytest.approx(800 / 3)
    assert face_centres_mm(mesh)[1] == pytest.approx([10 / 3, 10 / 3, 0])


PYRAMID = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [5, 5, 8]]
POLYGONS = [[0, 1, 4], [3, 2, 1, 0], [1, 2, 4], [2, 3, 4], [3, 0, 4]]


def _off() -> bytes:
    lines = ["OFF # pyramid", "5 5 0", *(" ".join(map(str, point)) for point in PYRAMID)]
    return "\n".join([*lines, *(f"{len(p)} " + " ".join(map(str, p)) + " 255 0 0" for p in POLYGONS)]).encode()


def _ply(format: str, polygons: list[list[int]] = POLYGONS) -> bytes:
    header = (
        f"ply\nformat {format} 1.0\ncomment by hand\nelement vertex 5\nproperty uchar red\nproperty double x\nproperty float y\n"
        f"property float z\nelement face {len(polygons)}\nproperty list uchar int vertex_indices\n"
        "property short flags\nend_header\n"
    ).encode()
    if format == "ascii":
        rows = [f"7 {x} {y} {z}" for x, y, z in PYRAMID] + [f"{len(p)} {' '.join(map(str, p))} 1" for p in polygons]
        return header + "\n".join(rows).encode()
    order = "<" if "little" in format else ">"
    vertices = b"".join(struct.pack(f"{order}Bdff", 7, *point) for point in PYRAMID)
    return header + vertices + b"".join(struct.pack(f"{order}B{len(p)}ih", len(p), *p, 1) for p in polygons)


@pytest.mark.parametrize(
    ("data", "format"),
    [
        (_off(), "off"),
        (_ply("ascii"), "ply"),
        (_ply("binary_little_endian"), "ply"),
        (_ply("binary_big_endian"), "ply"),
    ],
)
def test_polygons_become_fans_at_their_place_in_the_file(data: bytes, format: str) -> None:
    mesh = read_mesh(data, format, "mm")

    triangles = [[0, 1, 4], [3, 2, 1], [3, 1, 0], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    assert mesh.triangles_mm == pytest.approx(np.array(PYRAMID, dtype=float)[triangles])
    assert volume_mm3(mesh) == pytest.approx(800 / 3)


def test_a_binary_ply_of_triangles_is_read_at_once_and_of_big_endian_too() -> None:
    triangles = [[0, 1, 4], [3, 2, 1], [3, 1, 0], [1, 2, 4], [2, 3, 4], [3, 0, 4]]

    for format in ("binary_little_endian", "binary_big_endian"):
        assert volume_mm3(read_mesh(_ply(format, triangles), "ply", "mm")) == pytest.approx(800 / 3)


@pytest.mark.parametrize("cut", [1, 40, 120])
@pytest.mark.parametrize("format", ["binary_little_endian", "ascii"])
def test_a_ply_that_ends_early_is_refused(format: str, cut: int) -> None:
    data = _ply(format)

    with pytest.raises(InvalidGeometry, match="PLY"):
        read_mesh(data[:-cut] if cut > 1 or format != "ascii" else data[:-2], "ply", "mm")


def test_an_off_that_ends_early_is_refused() -> None:
    with pytest.raises(InvalidGeometry, match="ends early: it declares 5 vertices and 5 faces"):
        read_mesh(_off().rpartition(b"\n")[0], "off", "mm")


def test_a_3mf_states_its_unit_and_keeps_its_faces() -> None:
    ring = _shuffled_ring()
    mesh = Mesh(vertices_mm=np.array(ring.vertices), faces=np.array(ring.faces))
    data = threemf_bytes(mesh, "ring")
    inches = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as source, zipfile.ZipFile(inches, "w") as target:
        for name in source.namelist():
            target.writestr(name, source.read(name).replace(b'unit="millimeter"', b'unit="inch"'))

    assert face_centres_mm(read_mesh(data, "3mf", None)) == pytest.approx(ring.triangles_center, abs=1e-9)
    assert face_centres_mm(read_mesh(inches.getvalue(), "3mf", None)) == pytest.approx(ring.triangles_center * 25.4, abs=1e-9)
    with pytest.raises(InvalidGeometry, match="but units says in"):
        read_mesh(data, "3mf", "in")


def test_a_glb_is_in_metres_unless_units_are_stated() -> None:
    data = _file(_shuffled_ring(), "glb")

    assert volume_mm3(read_mesh(data, "glb", None)) == pytest.approx(_shuffled_ring().volume * 1e9, rel=1e-5)
    assert volume_mm3(read_mesh(data, "glb", "mm")) == pytest.approx(_shuffled_ring().volume, rel=1e-5)


def test_a_mirrored_instance_of_a_scene_stays_outward() -> None:
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box([0.01, 0.02, 0.03]), transform=np.diag([-1.0, 1.0, 1.0, 1.0]))

    assert volume_mm3(read_mesh(scene.export(file_type="glb"), "glb", None)) == pytest.approx(6000, rel=1e-5)


def test_a_step_file_is_tessellated_closed_within_its_deflection() -> None:
    solid = cut(box((0, 0, 0), (40, 30, 20)), [cylinder_z(20, 15, 8, -1, 21)])
    data = step_bytes(write_brep(solid), name="block", part_number="B-1")

    mesh = read_mesh(data, "step", None)

    assert trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False).is_watertight
    assert volume_mm3(mesh) == pytest.approx(measure(solid).volume_mm3, rel=1e-3)


def test_a_step_file_in_inches_comes_in_mm_and_is_not_taken_for_another_unit() -> None:
    data = step_bytes(write_brep(box((0, 0, 0), (1, 2, 3))), name="block", part_number="B-1")
    millimetre = b"( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
    assert millimetre in data
    metres = data.replace(millimetre, b"( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) )")

    assert volume_mm3(read_mesh(metres, "step", None)) == pytest.approx(6e9)
    assert volume_mm3(read_mesh(metres, "step", "m")) == pytest.approx(6e9)
    with pytest.raises(InvalidGeometry, match="states its lengths in m, but units says mm"):
        read_mesh(metres, "step", "mm")


def test_degenerate_faces_are_kept_so_that_face_numbers_stay_those_of_the_file() -> None:
    vertices = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10.0]])
    faces = np.array([[0, 2, 1], [0, 0, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])

    mesh = read_mesh(stl_bytes(Mesh(vertices_mm=vertices, faces=faces)), "stl", "mm")

    assert len(mesh.faces) == 5
    assert face_centres_mm(mesh) == pytest.approx(vertices[faces].mean(axis=1))


@pytest.mark.parametrize(
    ("data", "format", "reason"),
    [
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "obj", "holds no triangle"),
        (b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "obj", "not numbers"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "obj", "vertices that it does not have"),
        (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "obj", "no triangle that has an area"),
        (b"v 0 0 0\nv 1e9 0 0\nv 0 1 0\nf 1 2 3\n", "obj", "are the units right"),
        (b"v 0 0 0\nv 1e-9 0 0\nv 0 1e-9 0\nf 1 2 3\n", "obj", "are the units right"),
        (b"v 0 0\n", "obj", "line 1"),
        (b"solid nothing\nendsolid nothing\n", "stl", "holds no triangle"),
        (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n", "step", "is damaged: faults of its structure"),
    ],
)
def test_a_mesh_on_which_nothing_can_be_computed_is_refused(data: bytes, format: str, reason: str) -> None:
    with pytest.raises(InvalidGeometry, match=reason):
        read_mesh(data, format, None if format == "step" else "mm")


def test_a_3mf_that_is_no_archive_is_refused() -> None:
    with pytest.raises(InvalidInput, match="no zip archive"):
        read_mesh(b"PK not really", "3mf", None)


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1), ("cm", 10), ("m", 1000), ("in", 25.4)])
def test_lengths_are_converted_once_and_arguments_stay(unit: str, factor: float) -> None:
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])

    assert mesh_in_mm(vertices, faces, unit).vertices_mm == pytest.approx(np.eye(3) * factor)
    assert np.array_equal(vertices, np.eye(3))


@pytest.mark.parametrize(
    ("name", "format"), [("a.STL", "stl"), ("x/b.stp", "step"), ("c.Step", "step"), ("d.zip", None), ("e", None)]
)
def test_the_format_follows_from_the_extension_in_any_case(name: str, format: str | None) -> None:
    assert format_of(name) == format


def test_two_solids_of_a_step_file_keep_the_numbers_of_their_faces_apart() -> None:
    pair = fuse(box((0, 0, 0), (10, 20, 30)), box((20, 0, 0), (30, 20, 30)))

    mesh = read_mesh(step_bytes(write_brep(pair), name="pair", part_number="P-1"), "step", None)

    assert mesh.cad_faces is not None
    numbers_of_solids = [
        set(mesh.cad_faces[face_centres_mm(mesh)[:, 0] < 15]),
        set(mesh.cad_faces[face_centres_mm(mesh)[:, 0] > 15]),
    ]
    assert [len(numbers) for numbers in numbers_of_solids] == [6, 6]
    assert set.union(*numbers_of_solids) == set(range(12))


def test_a_file_of_triangles_has_no_cad_faces() -> None:
    mesh = read_mesh(_file(_shuffled_ring(), "stl"), "stl", "mm")

    assert mesh.cad_faces is None
