"""How far a surface turns about an edge: sharp, blurred, or smooth."""

import numpy as np
import pytest

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.adjacency import exterior_angles_rad, face_adjacency
from gripwright.geometry.bends import bends_rad
from gripwright.geometry.measures import face_normals
from gripwright.geometry.refine import refine
from mesh_factory import STEPPED_SHAFT, box_mesh, filleted_boss, turned_mesh

LOW_STEP = ((0.0, 0.0), (10.0, 0.0), (10.0, 20.0), (9.5, 20.0), (9.5, 40.0), (0.0, 40.0))


def bends(mesh: Mesh, reach_mm: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bend and exterior angle of each edge, degrees, and its two ends, (e, 2, 3)."""
    adjacency, normals = face_adjacency(mesh), face_normals(mesh)
    angles = exterior_angles_rad(mesh, adjacency, normals)
    found = bends_rad(mesh, adjacency, angles, normals, reach_mm)
    return np.degrees(found), np.degrees(angles), mesh.vertices_mm[adjacency.edges]


@pytest.mark.parametrize("edge_mm", [3.0, 0.7])
def test_a_sharp_edge_is_its_own_bend_and_the_faces_beside_it_have_none(edge_mm: float) -> None:
    found, angles, _ = bends(refine(box_mesh((30.0, 20.0, 10.0)), edge_mm), 4.0)

    np.testing.assert_allclose(found, angles, atol=1e-9)


@pytest.mark.parametrize(("sections", "ring_mm"), [(24, 1.0), (96, 1.0), (96, 0.4)])
def test_a_fillet_is_a_crease_in_its_middle_however_it_is_divided(sections: int, ring_mm: float) -> None:
    mesh = refine(filleted_boss(sections), ring_mm)

    found, angles, ends = bends(mesh, 12.0)

    middle, level = ends.mean(axis=1), np.abs(ends[:, 0, 2] - ends[:, 1, 2]) < 1e-9
    radius, height = np.hypot(middle[:, 0], middle[:, 1]), middle[:, 2]
    fillet = (np.abs(radius - 14.0 + 4.0 * np.sin(np.pi / 4)) < 0.8) & (np.abs(height - 12.0 + 4.0 * np.cos(np.pi / 4)) < 0.8)
    around = fillet & (angles < -1.0) & level
    assert around.sum() >= sections
    assert found[around].max() < -60.0
    assert found[around].min() > -91.0


def test_a_cylinder_bends_by_the_reach_over_its_radius() -> None:
    found, angles, ends = bends(turned_mesh(((0.0, 0.0), (10.0, 0.0), (10.0, 20.0), (0.0, 20.0)), 180), 2.0)

    lateral = (np.abs(ends[:, :, 2].mean(axis=1) - 10.0) < 5.0) & (np.abs(angles) > 1.0)
    assert lateral.sum() == 180
    np.testing.assert_allclose(found[lateral], np.degrees(2.0 / 10.0), rtol=0.02)


def test_the_crease_of_a_step_lower_than_the_reach_stays_a_crease() -> None:
    found, angles, _ = bends(turned_mesh(LOW_STEP, 48), 3.0)

    assert (angles < -80.0).sum() == 48
    assert found[angles < -80.0].max() < -80.0


def test_bends_scale_with_the_mesh_and_do_not_depend_on_its_pose() -> None:
    mesh = refine(turned_mesh(STEPPED_SHAFT, 32), 2.0)
    R = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    R *= np.sign(np.linalg.det(R))
    moved = Mesh(vertices_mm=1000.0 * mesh.vertices_mm @ R.T + 77.0, faces=mesh.faces)

    np.testing.assert_allclose(bends(moved, 1000.0)[0], bends(mesh, 1.0)[0], atol=1e-3)


def test_an_open_mesh_bends_like_the_closed_one_away_from_the_hole() -> None:
    mesh = refine(box_mesh((10.0, 10.0, 10.0)), 1.0)
    open_mesh = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[1:])

    found, angles, _ = bends(open_mesh, 2.0)

    np.testing.assert_allclose(found, angles, atol=1e-9)
