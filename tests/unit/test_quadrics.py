"""Planes, cylinders, cones and spheres: proposed from oriented points, followed, and fitted by least squares."""

import numpy as np
import pytest

from gripwright.domain.shape import FloatArray
from gripwright.geometry.quadrics import CONE, CYLINDER, KINDS, PLANE, SPHERE, Quadrics, closeness, fitted, propose

POINT, AXIS = np.array([5.0, -2.0, 30.0]), np.array([0.48, 0.6, 0.64])


def surface(kind: int, sign: float, count: int = 200) -> tuple[FloatArray, FloatArray]:
    """Points and outward normals on the surface about POINT and AXIS: radius 8, half angle 30°."""
    rng = np.random.default_rng(1)
    e1 = np.cross(AXIS, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(AXIS, [1.0, 0.0, 0.0]))
    angle, along = rng.uniform(0, 2 * np.pi, count), rng.uniform(4.0, 20.0, count)
    across = np.outer(np.cos(angle), e1) + np.outer(np.sin(angle), np.cross(AXIS, e1))
    if kind == PLANE:
        return POINT + across * along[:, None], np.tile(AXIS, (count, 1))
    if kind == CYLINDER:
        return POINT + across * 8.0 + np.outer(along, AXIS), across * sign
    if kind == CONE:
        half = np.radians(30.0)
        points = POINT + across * (along * np.tan(half))[:, None] + np.outer(along, AXIS)
        return points, (across * np.cos(half) - AXIS * np.sin(half)) * sign
    height = rng.uniform(-0.9, 0.9, count)
    normals = across * np.sqrt(1.0 - height**2)[:, None] + np.outer(height, AXIS)
    return POINT + 8.0 * normals, normals * sign


CASES = [(kind, sign) for kind in range(4) for sign in (1.0, -1.0) if (kind, sign) != (PLANE, -1.0)]
NAMES = [f"{KINDS[kind]} {'solid' if sign > 0 else 'hollow'}" for kind, sign in CASES]


@pytest.mark.parametrize(("kind", "sign"), CASES, ids=NAMES)
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_the_surface_that_points_lie_on_is_proposed_with_its_side(kind: int, sign: float, unit: float) -> None:
    points, normals = surface(kind, sign)

    found = propose(points * unit, normals, np.arange(3), np.random.default_rng(0))
    support = closeness(found, points * unit, normals, np.full(len(points), 0.01 * unit), 0.1).sum(axis=1)
    best = found.select(np.array([support.argmax()]))

    assert support.max() > 0.99 * len(points)
    assert (best.kinds[0], best.signs[0]) == (kind, sign)
    opposite = closeness(best, points * unit, -normals, np.full(len(points), 0.01 * unit), 0.1)
    assert opposite.sum() == 0.0


@pytest.mark.parametrize(("kind", "size"), [(CYLINDER, 8.0), (CONE, np.radians(30.0)), (SPHERE, 8.0)], ids=KINDS[1:])
def test_least_squares_find_the_surface_from_a_start_near_it(kind: int, size: float) -> None:
    points, _ = surface(kind, 1.0)
    tilted = AXIS + np.array([0.1, -0.05, 0.02])
    start = Quadrics(
        kinds=np.array([kind]),
        points_mm=POINT[None] + np.array([0.5, -0.4, 0.3]),
        axes=(tilted / np.linalg.norm(tilted))[None],
        sizes=np.array([size * 1.1]),
        signs=np.ones(1),
    )

    found = fitted(start, points)

    assert found.sizes[0] == pytest.approx(size, rel=1e-6)
    off = found.points_mm[0] - POINT
    if kind == CYLINDER:
        off = off - (off @ AXIS) * AXIS  # any point of the axis will do
    np.testing.assert_allclose(off, 0.0, atol=1e-4)
    if kind != SPHERE:
        assert abs(found.axes[0] @ AXIS) == pytest.approx(1.0, abs=1e-9)


def test_least_squares_find_the_plane() -> None:
    points, _ = surface(PLANE, 1.0)
    start = Quadrics(
        kinds=np.array([PLANE]),
        points_mm=POINT[None] + 1.0,
        axes=np.array([[0.6, 0.48, 0.64]]),
        sizes=np.zeros(1),
        signs=np.ones(1),
    )

    found = fitted(start, points)

    np.testing.assert_allclose(found.axes[0], AXIS, atol=1e-6)
    assert (POINT - found.points_mm[0]) @ AXIS == pytest.approx(0.0, abs=1e-6)
