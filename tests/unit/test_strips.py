"""Strips over planar regions, against what shapely cuts out."""

import numpy as np
import pytest
import shapely

from gripwright.geometry.strips import boundary_edges, strip_ranges


def cut(region: shapely.Geometry, along: np.ndarray, offset: float, width: float) -> tuple[float, float]:
    across = np.array([-along[1], along[0]])
    corners = [offset * across + s * 1e3 * along + t * width / 2.0 * across for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    level = np.asarray(shapely.get_coordinates(shapely.intersection(region, shapely.polygons(corners)))) @ along
    return (float(level.min()), float(level.max())) if len(level) else (np.inf, -np.inf)


@pytest.mark.parametrize("seed", range(4))
def test_a_strip_reaches_as_far_as_the_region_within_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    disks = shapely.buffer(shapely.points(rng.uniform(-20.0, 20.0, (6, 2))), rng.uniform(2.0, 12.0, 6), quad_segs=4)
    region = shapely.difference(shapely.union_all(disks), shapely.box(-3.0, -3.0, 4.0, 2.0))  # parts, and holes
    turns = np.append(rng.uniform(0.0, 2.0 * np.pi, 5), [0.0, np.pi / 2.0])
    along = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    offsets = rng.uniform(-40.0, 40.0, (len(turns), 9))

    found = strip_ranges(boundary_edges(region), along, offsets, 7.0)

    expected = np.array([[cut(region, along[t], offset, 7.0) for offset in offsets[t]] for t in range(len(turns))])
    missed = np.isinf(expected).any(axis=2)
    assert missed.any()
    assert (np.isinf(found).any(axis=2) == missed).all()
    assert found[~missed] == pytest.approx(expected[~missed], abs=1e-9)


def test_edges_along_the_strip_and_at_its_side_count() -> None:
    edges = boundary_edges(shapely.box(0.0, 0.0, 30.0, 10.0))

    found = strip_ranges(edges, np.array([[1.0, 0.0]]), np.array([[5.0, 14.0, 16.0]]), 10.0)

    assert found[0, :2].tolist() == [[0.0, 30.0], [0.0, 30.0]]
    assert found[0, 2, 0] > found[0, 2, 1]
