import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting_cases import cramer_rao, random_rotation, revolved
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.corners import corner_vertices
from gripwright.geometry.surfaces import CylinderFit, fit_cylinder, fit_plane


def unit_points(arc_deg: float, columns: int = 24, rows: int = 8) -> FloatArray:
    profile = np.stack([np.ones(rows), np.linspace(0.0, 1.5, rows)], axis=1)
    return revolved(profile, np.radians(arc_deg), columns).vertices_mm


@given(seed=st.integers(0, 10_000), arc_deg=st.floats(20.0, 355.0), decade=st.floats(-4.0, 4.0))
@settings(max_examples=60, deadline=None)
def test_exact_points_give_the_exact_cylinder_in_any_pose_and_unit(seed: int, arc_deg: float, decade: float) -> None:
    rng = np.random.default_rng(seed)
    R, shift, scale = random_rotation(rng), 5.0 * rng.normal(size=3), 10.0**decade
    points = (unit_points(arc_deg) @ R.T + shift) * scale
    start = scale * (shift + 0.1 * rng.normal(size=3)), R[:, 2] + 0.1 * rng.normal(size=3), 1.2 * scale

    fit = fit_cylinder(points, *start)

    assert fit is not None
    assert fit.radius_mm == pytest.approx(scale, rel=1e-5)
    assert abs(fit.axis @ R[:, 2]) == pytest.approx(1.0, abs=1e-9)
    assert fit.rms_mm <= 1e-6 * scale


@pytest.mark.parametrize("arc_deg", [60.0, 120.0, 360.0])
def test_errors_and_their_stated_size_agree_with_the_cramer_rao_bound(arc_deg: float) -> None:
    rng, clean, noise = np.random.default_rng(3), unit_points(arc_deg), 0.004
    radius_bound, axis_bound = cramer_rao(clean, noise)
    axis = np.array([0.0, 0.0, 1.0])

    fits = [fit_cylinder(clean + noise * rng.normal(size=clean.shape), np.zeros(3), axis, 1.0) for _ in range(200)]

    found = [fit for fit in fits if fit is not None]
    assert len(found) == 200
    assert np.std([fit.radius_mm for fit in found]) == pytest.approx(radius_bound, rel=0.2)
    assert np.median([fit.radius_sigma_mm for fit in found]) == pytest.approx(radius_bound, rel=0.1)
    assert np.median([fit.axis_sigma_rad for fit in found]) == pytest.approx(axis_bound, rel=0.1)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((10, 3)),
        np.outer(np.arange(10.0), [1.0, 2.0, 3.0]),
        np.random.default_rng(0).normal(size=(5, 3)),
    ],
    ids=["one point", "a line", "too few"],
)
def test_points_that_determine_no_cylinder_give_none(points: FloatArray) -> None:
    assert fit_cylinder(points, np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.0) is None


def test_distances_are_positive_outside() -> None:
    fit = CylinderFit(
        point_mm=np.zeros(3), axis=np.array([0.0, 0, 1]), radius_mm=2.0, rms_mm=0.0, radius_sigma_mm=0.0, axis_sigma_rad=0.0
    )

    assert fit.distances_mm(np.array([[3.0, 0, 9], [0, 1.5, -9]])) == pytest.approx([1.0, -0.5])


def test_the_plane_of_points_is_found_in_any_pose() -> None:
    rng = np.random.default_rng(2)
    R = random_rotation(rng)
    points = np.c_[rng.normal(size=(50, 2)), np.full(50, 3.0)] @ R.T

    plane = fit_plane(points)

    assert abs(plane.normal @ R[:, 2]) == pytest.approx(1.0)
    assert abs(plane.offset_mm) == pytest.approx(3.0)
    assert plane.rms_mm == pytest.approx(0.0, abs=1e-9)


def test_vertices_on_the_chords_of_facets_are_no_corners() -> None:
    ring = revolved(np.array([[1.0, 0.0], [1.0, 2.0]]), 2.0 * np.pi, 12)
    divided = _divided(ring)

    corners = corner_vertices(divided, np.arange(len(divided.vertices_mm)))

    assert np.hypot(*divided.vertices_mm[corners, :2].T) == pytest.approx(1.0)
    assert len(corners) == 24


def _divided(mesh: Mesh) -> Mesh:
    """Every face in four: new vertices in the middle of edges."""
    shape = trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False).subdivide()
    return Mesh(vertices_mm=np.array(shape.vertices), faces=np.array(shape.faces, dtype=np.int64))
