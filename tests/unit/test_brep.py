import numpy as np
import pytest

from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import Mesh
from gripwright.geometry import brep
from gripwright.geometry.measures import face_areas_mm2, volume_mm3


def plate() -> brep.Shape:
    """A plate of 20 × 30 × 5 with a hole of radius 4."""
    outline = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 30.0], [0.0, 30.0]])
    return brep.cut(brep.prism_z(outline, 0.0, 5.0), [brep.cylinder_z(10.0, 15.0, 4.0, -1.0, 6.0)])


def is_closed(mesh: Mesh) -> bool:
    """Every directed edge is used once, and so is its opposite."""
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forward = {tuple(edge) for edge in edges.tolist()}
    return len(forward) == len(edges) and all((b, a) in forward for a, b in forward)


def test_volume_and_centre_of_mass_are_exact() -> None:
    measured = brep.measure(plate())

    assert measured.volume_mm3 == pytest.approx(3000.0 - 16.0 * np.pi * 5.0, rel=1e-9)
    assert measured.centre_of_mass_mm == pytest.approx([10.0, 15.0, 2.5], abs=1e-9)


def test_a_tessellation_is_closed_points_outwards_and_keeps_the_volume() -> None:
    shape = plate()

    mesh = brep.tessellate(shape)

    assert is_closed(mesh)
    assert volume_mm3(mesh) == pytest.approx(brep.measure(shape).volume_mm3, rel=2e-3)
    radii = np.linalg.norm(mesh.vertices_mm[:, :2] - [10.0, 15.0], axis=1)
    assert radii.min() == pytest.approx(4.0, abs=1e-6)


def test_every_triangle_says_which_face_of_the_solid_it_comes_from() -> None:
    mesh = brep.tessellate(plate())

    areas_mm2 = np.bincount(mesh.cad_faces, weights=face_areas_mm2(mesh))
    wall, ends = 2.0 * np.pi * 4.0 * 5.0, 600.0 - 16.0 * np.pi
    assert np.sort(areas_mm2) == pytest.approx(sorted([wall, ends, ends, 100.0, 100.0, 150.0, 150.0]), rel=5e-3)


def test_a_tessellation_stays_within_the_deviation() -> None:
    mesh = brep.tessellate(brep.cylinder_z(0.0, 0.0, 25.0, 0.0, 1.0), deviation_mm=0.02)

    rim = mesh.vertices_mm[mesh.vertices_mm[:, 2] > 0.5]
    angles = np.sort(np.arctan2(rim[:, 1], rim[:, 0]))
    sagitta = 25.0 * (1.0 - np.cos(np.diff(angles).max() / 2.0))
    assert sagitta <= 0.02


def test_the_same_steps_give_the_same_bytes_and_the_same_mesh() -> None:
    first, second = plate(), plate()

    assert brep.write_brep(first) == brep.write_brep(second)
    assert np.array_equal(brep.tessellate(first).vertices_mm, brep.tessellate(second).vertices_mm)
    assert np.array_equal(brep.tessellate(first).faces, brep.tessellate(second).faces)


def test_tessellating_leaves_no_triangles_in_the_stored_solid() -> None:
    shape = plate()
    before = brep.write_brep(shape)

    brep.tessellate(shape)

    assert brep.write_brep(shape) == before


def test_a_stored_solid_reads_back_as_one_valid_solid_of_the_same_volume() -> None:
    shape = plate()

    read = brep.single_solid(brep.read_brep(brep.write_brep(shape)))

    assert brep.measure(read).volume_mm3 == pytest.approx(brep.measure(shape).volume_mm3, rel=1e-12)
    assert brep.bounds_mm(read) == pytest.approx(brep.bounds_mm(shape))


@pytest.mark.parametrize("damage", [lambda b: b"", lambda b: b"solid cube", lambda b: b[:400], lambda b: b[:60]])
def test_bytes_that_are_no_solid_are_refused(damage) -> None:
    with pytest.raises(InvalidGeometry):
        brep.single_solid(brep.read_brep(damage(brep.write_brep(plate()))))


def test_two_solids_apart_are_not_one() -> None:
    apart = brep.fuse(brep.box((0, 0, 0), (1, 1, 1)), brep.box((2, 0, 0), (3, 1, 1)))

    with pytest.raises(InvalidGeometry, match="2 solids"):
        brep.single_solid(apart)


def test_a_union_merges_coplanar_neighbours() -> None:
    bar = brep.fuse(brep.box((0, 0, 0), (1, 1, 1)), brep.box((1, 0, 0), (3, 1, 1)))

    assert len(brep.tessellate(bar).faces) == 12


def test_a_chamfer_takes_a_prism_off_the_chosen_edge_alone() -> None:
    block = brep.box((0, 0, 0), (8, 10, 30))

    chamfered = brep.chamfer(block, 1.0, np.array([8.0, 0.0, 30.0]), np.array([8.0, 10.0, 30.0]))

    assert brep.measure(chamfered).volume_mm3 == pytest.approx(2400.0 - 5.0)
    assert brep.bounds_mm(chamfered) == pytest.approx(brep.bounds_mm(block))


def test_common_is_what_two_solids_share() -> None:
    shared = brep.common(brep.box((0, 0, 0), (2, 2, 2)), brep.box((1, 1, 1), (3, 3, 3)))

    assert brep.bounds_mm(shared) == pytest.approx(np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]), abs=1e-6)
