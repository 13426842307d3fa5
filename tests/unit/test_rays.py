"""Rays and the shape diameter against closed forms."""

import numpy as np
import pytest

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.measures import face_centres_mm, face_normals
from gripwright.geometry.mesh_repair import repaired
from gripwright.geometry.rays import RayScene, morton_order
from gripwright.geometry.refine import refine
from gripwright.geometry.shape_diameter import cone_directions, filled, shape_diameters_mm
from mesh_factory import box_mesh, moved, sphere_mesh, turned_mesh

CONE_RAD = np.radians(120.0)


def _mean_without_outliers(lengths: FloatArray) -> float:
    """The definition, written once more: rays beyond 1.5 median absolute deviations do not count."""
    middle = np.median(lengths)
    deviation = np.abs(lengths - middle)
    return float(lengths[deviation <= 1.5 * np.median(deviation) * (1 + 1e-9)].mean())


def _random_pose(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    z = rng.normal(size=3)
    z /= np.linalg.norm(z)
    x = any_perpendicular(z)
    return pose(x, np.cross(z, x), z, rng.normal(size=3) * 100.0)


def test_a_ray_reports_distance_face_and_outward_normal() -> None:
    box = box_mesh((2.0, 4.0, 6.0))
    scene = RayScene(box.vertices_mm, box.faces)

    distance, face, normal = scene.first_hits(
        scene.centred(np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 7.0]])), np.array([[0, 1, 0], [0, 0, 1]], dtype=np.float32)
    )

    assert distance[0] == pytest.approx(2.0)
    np.testing.assert_allclose(face_normals(box)[face[0]], [0, 1, 0], atol=1e-12)
    assert normal[0, 1] > 0
    assert face[1] == -1


def test_morton_order_is_a_permutation_that_keeps_neighbours_together() -> None:
    points = np.random.default_rng(0).random((5000, 3))

    order = morton_order(points)

    np.testing.assert_array_equal(np.sort(order), np.arange(5000))
    assert np.linalg.norm(np.diff(points[order], axis=0), axis=1).mean() < 0.1


def test_directions_lie_in_the_cone_and_are_units() -> None:
    directions = cone_directions(30, CONE_RAD)

    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert directions[:, 2].min() >= np.cos(CONE_RAD / 2)
    assert np.linalg.norm(directions[:, :2].mean(axis=0)) < 0.05


def test_shape_diameter_of_a_slab() -> None:
    slab = refine(box_mesh((200.0, 200.0, 3.0)), 20.0)
    inner = np.linalg.norm(face_centres_mm(slab)[:, :2] - 100.0, axis=1) < 90.0
    expected = _mean_without_outliers(3.0 / cone_directions(30, CONE_RAD)[:, 2])

    found = shape_diameters_mm(slab, 30, CONE_RAD)

    np.testing.assert_allclose(found[inner & (np.abs(face_normals(slab)[:, 2]) > 0.5)], expected, rtol=2e-4)


def test_shape_diameter_of_a_sphere() -> None:
    expected = _mean_without_outliers(2.0 * 7.0 * cone_directions(30, CONE_RAD)[:, 2])

    found = shape_diameters_mm(sphere_mesh(7.0, 128), 30, CONE_RAD)

    np.testing.assert_allclose(found, expected, rtol=0.04)  # a ray at the limit may count or not


def test_shape_diameter_of_a_long_cylinder() -> None:
    mesh = repaired(turned_mesh(((0, 0), (4, 0), (4, 100), (0, 100)), 180, ring_mm=5.0))
    centres = face_centres_mm(mesh)
    middle = (np.abs(centres[:, 2] - 50.0) < 25.0) & (np.linalg.norm(centres[:, :2], axis=1) > 3.9)
    turn = np.linspace(0.0, np.pi, 7)  # the pattern's place about the normal is free
    d = cone_directions(30, CONE_RAD)
    along = np.outer(np.cos(turn), d[:, 0]) - np.outer(np.sin(turn), d[:, 1])  # (7, 30) component along the axis
    lengths = 2.0 * 4.0 * d[:, 2] / (1.0 - along**2)
    expected = [_mean_without_outliers(row) for row in lengths]

    found = shape_diameters_mm(mesh, 30, CONE_RAD)[middle]

    assert found.min() >= min(expected) * 0.97
    assert found.max() <= max(expected) * 1.03


def test_shape_diameter_does_not_depend_on_the_pose() -> None:
    mesh = refine(box_mesh((20.0, 9.0, 4.0)), 3.0)

    here, there = (shape_diameters_mm(m, 30, CONE_RAD) for m in (mesh, moved(mesh, _random_pose(3))))

    assert np.median(np.abs(there / here - 1.0)) < 1e-4
    assert np.quantile(np.abs(there / here - 1.0), 0.98) < 0.05  # rays that graze an edge may fall to either side


def test_a_mesh_far_from_the_origin_loses_nothing() -> None:
    mesh = refine(box_mesh((20.0, 9.0, 4.0)), 3.0)
    far = Mesh(vertices_mm=mesh.vertices_mm + 1e5, faces=mesh.faces)

    assert not np.isnan(shape_diameters_mm(far, 30, CONE_RAD)).any()


def test_faces_seen_from_outside_have_no_shape_diameter() -> None:
    box = box_mesh((1.0, 1.0, 1.0))

    assert np.isnan(shape_diameters_mm(Mesh(vertices_mm=box.vertices_mm, faces=box.faces[:, ::-1]), 30, CONE_RAD)).all()


def test_missing_values_come_from_neighbours_near_to_far() -> None:
    chain = np.array([[0, 1], [1, 2], [2, 3]])

    np.testing.assert_array_equal(filled(np.array([4.0, np.nan, np.nan, 8.0]), chain), [4, 4, 8, 8])
    np.testing.assert_array_equal(filled(np.full(4, np.nan), chain), np.zeros(4))
