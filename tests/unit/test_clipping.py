import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray
from gripwright.geometry.clipping import clip_to_box, longest_run, near_box


def areas(triangles: FloatArray) -> FloatArray:
    edges = triangles[:, 1:] - triangles[:, :1]
    return np.asarray(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2.0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 2), st.floats(-2.0, 2.0))
def test_both_sides_of_a_plane_make_up_the_whole(seed: int, axis: int, offset: float) -> None:
    triangles = np.random.default_rng(seed).normal(size=(20, 3, 3))
    everywhere = np.full(3, np.inf)
    limit = np.where(np.arange(3) == axis, offset, np.inf)

    below = clip_to_box(triangles, -everywhere, limit)
    above = clip_to_box(triangles, np.where(np.arange(3) == axis, offset, -np.inf), everywhere)

    assert (below[..., axis] <= offset).all()
    assert (above[..., axis] >= offset).all()
    assert areas(below).sum() + areas(above).sum() == pytest.approx(areas(triangles).sum(), rel=1e-9)


def test_a_square_is_clipped_to_a_box_exactly() -> None:
    square = np.array([[[0, 0, 0], [4, 0, 0], [4, 4, 0]], [[0, 0, 0], [4, 4, 0], [0, 4, 0]]], dtype=float)

    part = clip_to_box(square, np.array([1.0, -np.inf, -1.0]), np.array([3.0, 2.5, 1.0]))

    assert areas(part).sum() == pytest.approx(2.0 * 2.5)
    assert part[..., 0].min() == pytest.approx(1.0)
    assert part[..., 1].max() == pytest.approx(2.5)


def test_nothing_is_left_outside_the_box() -> None:
    triangle = np.array([[[5, 5, 5], [6, 5, 5], [5, 6, 5]]], dtype=float)

    assert len(clip_to_box(triangle, np.zeros(3), np.ones(3))) == 0


@pytest.mark.parametrize(
    ("intervals", "length"),
    [([], 0.0), ([(0, 1), (1, 2)], 2.0), ([(0, 1), (1.5, 4), (3, 5)], 3.5), ([(0, 9), (2, 3), (8, 8.5)], 9.0)],
)
def test_the_longest_run_joins_what_touches(intervals: list[tuple[float, float]], length: float) -> None:
    assert longest_run(np.array(intervals, dtype=float).reshape(-1, 2)) == pytest.approx(length)


def test_balls_near_a_placed_box_are_found_and_no_others() -> None:
    rng = np.random.default_rng(4)
    centres, reach = rng.uniform(-10.0, 10.0, (500, 3)), rng.uniform(0.0, 1.0, 500)
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("xyz", [0.3, -1.0, 2.0]).as_matrix()
    X[:3, 3] = 1.0, 2.0, -1.0
    low, high = np.array([-3.0, -np.inf, -2.0]), np.array([4.0, 5.0, np.inf])

    found = near_box(centres, reach, X, low, high)

    placed = centres @ X[:3, :3].T + X[:3, 3]
    expected = ((placed >= low - reach[:, None]) & (placed <= high + reach[:, None])).all(axis=1)
    assert found.tolist() == np.flatnonzero(expected).tolist()
    assert 0 < len(found) < 500
