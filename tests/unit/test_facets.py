import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from gripwright.domain.shape import IntArray, Mesh
from gripwright.geometry.facets import coplanar_patches, facets
from gripwright.geometry.measures import face_areas_mm2, face_normals


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(vertices_mm=np.array(shape.vertices), faces=np.array(shape.faces, dtype=np.int64))


def everything(mesh: Mesh) -> IntArray:
    return np.arange(len(mesh.faces))


def test_a_block_has_its_six_sides_as_facets_however_finely_it_is_divided() -> None:
    block = mesh_of(trimesh.creation.box((10.0, 20.0, 30.0)).subdivide().subdivide())

    found = facets(block, everything(block), np.radians(5.0))

    assert [facet.area_mm2 for facet in found] == pytest.approx([600.0, 600.0, 300.0, 300.0, 200.0, 200.0])
    assert [facet.offset_mm for facet in found] == pytest.approx([5.0, 5.0, 10.0, 10.0, 15.0, 15.0])
    assert all(np.abs(facet.normal).max() == pytest.approx(1.0) for facet in found)


@given(seed=st.integers(0, 10_000), angle_deg=st.floats(1.0, 40.0))
@settings(max_examples=25, deadline=None)
def test_facets_partition_the_faces_and_stay_near_their_seed(seed: int, angle_deg: float) -> None:
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(2)
    ball.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    ball.apply_scale(rng.uniform(0.5, 2.0, 3))
    mesh = mesh_of(ball)

    found = facets(mesh, everything(mesh), np.radians(angle_deg))

    assert np.array_equal(np.sort(np.concatenate([facet.faces for facet in found])), everything(mesh))
    assert sum(facet.area_mm2 for facet in found) == pytest.approx(face_areas_mm2(mesh).sum())
    normals = face_normals(mesh)
    for facet in found:
        assert (normals[facet.faces] @ facet.normal).min() >= np.cos(np.radians(2.0 * angle_deg)) - 1e-9


@pytest.mark.parametrize(("angle_deg", "count"), [(4.0, 2), (6.0, 1)])
def test_a_slight_bend_is_one_facet_within_the_angle_and_two_beyond(angle_deg: float, count: int) -> None:
    bend = np.radians(5.0)
    points = [[0, 0, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [-np.cos(bend), 0, np.sin(bend)], [-np.cos(bend), 1, np.sin(bend)]]
    sheet = Mesh(vertices_mm=np.array(points, dtype=float), faces=np.array([[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]]))

    found = facets(sheet, everything(sheet), np.radians(angle_deg))

    assert len(found) == count


def test_facets_do_not_depend_on_pose_or_face_order() -> None:
    shape = trimesh.creation.cylinder(10.0, 30.0, sections=24)
    turned = shape.copy()
    turned.apply_transform(trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.7, 0.4])))
    mesh = mesh_of(turned)
    order = np.random.default_rng(1).permutation(len(mesh.faces))
    shuffled = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[order])

    before = facets(mesh_of(shape), everything(mesh), np.radians(5.0))
    after = facets(shuffled, everything(mesh), np.radians(5.0))

    assert [facet.area_mm2 for facet in after] == pytest.approx([facet.area_mm2 for facet in before])
    assert len(before) == 26


def test_planes_that_only_share_their_direction_are_different_patches() -> None:
    block = mesh_of(trimesh.creation.box((1.0, 1.0, 1.0)))

    patches = coplanar_patches(block, everything(block))

    assert len(np.unique(patches)) == 6


def test_no_faces_give_no_facets() -> None:
    block = mesh_of(trimesh.creation.box((1.0, 1.0, 1.0)))

    assert facets(block, np.zeros(0, dtype=np.int64), 0.1) == []
