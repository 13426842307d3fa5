"""The parts of the segmenter: the cut against another solver, soft clustering, joining of small parts."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import maximum_flow

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright.geometry.refine import refine
from gripwright_builtin.segmenters.energy import area_energy, border_shares
from gripwright_builtin.segmenters.graph_cut import (
    alpha_expansion,
    expand,
    expansion_by_groups,
    expansion_coarse_to_fine,
    labelling_energy,
)
from gripwright_builtin.segmenters.max_flow import minimum_cut
from gripwright_builtin.segmenters.segments import hull_volume_mm3, merged_small
from gripwright_builtin.segmenters.soft_clustering import cluster_probabilities
from gripwright_builtin.segmenters.surface import Surface, sampled_faces, surface_groups, surface_of
from mesh_factory import turned_mesh


def _random_graph(seed: int) -> tuple[IntArray, IntArray, IntArray]:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 80))
    pairs = rng.integers(0, n, (int(rng.integers(1, 3 * n)), 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    take = rng.integers(-50, 50, n) * rng.integers(0, 2, n)
    return take, pairs, rng.integers(0, rng.choice([2, 20, 1000]), len(pairs))


def _cut_value(taken: BoolArray, take: IntArray, pairs: IntArray, capacities: IntArray) -> int:
    return int(take[taken].sum() + capacities[taken[pairs[:, 0]] != taken[pairs[:, 1]]].sum())


def _least_cut_by_scipy(take: IntArray, pairs: IntArray, capacities: IntArray) -> int:
    n = len(take)
    items = np.arange(n)
    tails = np.concatenate((pairs[:, 0], pairs[:, 1], np.full(n, n), items))
    heads = np.concatenate((pairs[:, 1], pairs[:, 0], items, np.full(n, n + 1)))
    weights = np.concatenate((capacities, capacities, np.maximum(-take, 0), np.maximum(take, 0))).astype(np.int32)
    graph = coo_array((weights, (tails, heads)), shape=(n + 2, n + 2)).tocsr()
    return int(maximum_flow(graph, n, n + 1).flow_value) + int(np.minimum(take, 0).sum())


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_the_cut_is_as_small_as_the_one_of_another_solver(seed: int) -> None:
    take, pairs, capacities = _random_graph(seed)

    taken = minimum_cut(take, pairs, capacities)

    assert _cut_value(taken, take, pairs, capacities) == _least_cut_by_scipy(take, pairs, capacities)


def test_the_cut_of_a_grid_is_as_small_as_the_one_of_another_solver() -> None:
    rng = np.random.default_rng(7)
    number = np.arange(60 * 60).reshape(60, 60)
    pairs = np.concatenate(
        (
            np.stack((number[:, :-1], number[:, 1:]), axis=2).reshape(-1, 2),
            np.stack((number[:-1], number[1:]), axis=2).reshape(-1, 2),
        )
    )
    take, capacities = rng.integers(-100, 100, 3600), rng.integers(0, 120, len(pairs))

    taken = minimum_cut(take, pairs, capacities)

    assert _cut_value(taken, take, pairs, capacities) == _least_cut_by_scipy(take, pairs, capacities)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_an_expansion_is_the_best_of_all_choices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, k = 8, 3
    pairs = np.array([p for p in itertools.combinations(range(n), 2) if rng.random() < 0.4], dtype=np.int64).reshape(-1, 2)
    unary, pairwise = rng.integers(0, 30, (n, k)), 2 * rng.integers(0, 15, len(pairs))
    labels, label = rng.integers(0, k, n), int(rng.integers(0, k))

    found = expand(labels, label, unary, pairs, pairwise)

    choices = (np.where(np.array(bits), label, labels) for bits in itertools.product([False, True], repeat=n))
    best = min(labelling_energy(choice, unary, pairs, pairwise) for choice in choices)
    assert labelling_energy(found, unary, pairs, pairwise) == best


def _chain(count: int, rng: np.random.Generator) -> tuple[FloatArray, IntArray, FloatArray]:
    return rng.random((count, 4)), np.stack((np.arange(count - 1), np.arange(1, count)), axis=1), rng.random(count - 1)


def test_no_expansion_improves_the_labelling_that_is_found() -> None:
    data, pairs, costs = _chain(300, np.random.default_rng(2))
    scale = 2**20
    unary, pairwise = np.rint(data * scale).astype(np.int64), 2 * np.rint(costs * scale / 2).astype(np.int64)

    labels = alpha_expansion(data, pairs, costs)

    energy = labelling_energy(labels, unary, pairs, pairwise)
    for label in range(4):
        assert labelling_energy(expand(labels, label, unary, pairs, pairwise), unary, pairs, pairwise) >= energy - 300


def test_groups_of_one_item_change_nothing() -> None:
    data, pairs, costs = _chain(100, np.random.default_rng(3))

    np.testing.assert_array_equal(expansion_by_groups(data, pairs, costs, np.arange(100)), alpha_expansion(data, pairs, costs))


def test_coarse_to_fine_finds_borders_inside_groups() -> None:
    data = np.zeros((90, 2))
    data[:47, 1] = data[47:, 0] = 1.0
    pairs = np.stack((np.arange(89), np.arange(1, 90)), axis=1)

    labels = expansion_coarse_to_fine(data, pairs, np.full(89, 2.0), np.arange(90) // 10)

    np.testing.assert_array_equal(labels, np.arange(90) >= 47)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32), common=st.booleans())
def test_probabilities_are_a_distribution(seed: int, common: bool) -> None:
    rng = np.random.default_rng(seed)
    values = rng.random(int(rng.integers(1, 300))) ** 2

    found = cluster_probabilities(values, rng.random(len(values)) + 0.1, 5, common)

    assert 1 <= found.shape[1] <= 5
    np.testing.assert_allclose(found.sum(axis=1), 1.0)


def test_separate_heaps_are_separate_clusters() -> None:
    rng = np.random.default_rng(0)
    heap = np.repeat(np.arange(3), 200)
    values = np.array([0.1, 0.5, 0.9])[heap] + rng.normal(scale=0.02, size=600)

    best = cluster_probabilities(values, np.ones(600), 3, common_spread=True).argmax(axis=1)

    np.testing.assert_array_equal(best, heap)


def test_weights_count_like_repetitions() -> None:
    values = np.random.default_rng(1).random(50)
    weights = np.arange(1, 51)

    weighted = cluster_probabilities(values, weights.astype(float), 4, common_spread=False)
    repeated = cluster_probabilities(np.repeat(values, weights), np.ones(weights.sum()), 4, common_spread=False)

    np.testing.assert_allclose(weighted, repeated[np.cumsum(weights) - 1], atol=1e-9)


def test_a_border_is_dear_on_smooth_surface_and_cheap_in_a_concave_crease() -> None:
    angles = np.radians([0.0, 15.0, 90.0, -90.0])

    flat, facet, convex, concave = border_shares(angles, angles)

    assert flat == facet == 1.0
    assert concave < 0.02 < convex < 0.5


def test_a_concave_bend_without_a_sharp_edge_is_cheap_but_an_edge_in_it_cheaper() -> None:
    fillet, crease = border_shares(np.radians([-9.0, -90.0]), np.radians([-90.0, -90.0]))

    assert crease < fillet < 0.05


def test_the_energy_does_not_change_when_faces_are_divided() -> None:
    coarse = refine(turned_mesh(((0, 0), (5, 0), (5, 20), (0, 20)), 24), 4.0)
    fine = refine(coarse, 1.0)
    energies = []
    for mesh in (coarse, fine):
        surface = surface_of(mesh)
        upper = (mesh.triangles_mm[:, :, 2].min(axis=1) >= 10.0 - 1e-9).astype(np.int64)
        odds = np.where(upper[:, None] == [0, 1], 0.9, 0.1)
        energy = area_energy(odds, surface.areas_mm2, surface.shares, surface.lengths_mm, 0.26)
        apart = upper[surface.pairs[:, 0]] != upper[surface.pairs[:, 1]]
        energies.append(energy.data[np.arange(len(upper)), upper].sum() + energy.borders[apart].sum())

    assert energies[0] == pytest.approx(energies[1], rel=1e-9)


def _strip(lengths: list[float], areas: list[float]) -> Surface:
    count = len(areas)
    return Surface(
        areas_mm2=np.array(areas),
        area_vectors_mm2=np.zeros((count, 3)),
        pairs=np.stack((np.arange(count - 1), np.arange(1, count)), axis=1),
        angles_rad=np.zeros(count - 1),
        bends_rad=np.zeros(count - 1),
        lengths_mm=np.array(lengths),
        shares=np.ones(count - 1),
    )


def test_a_small_part_joins_the_neighbour_with_the_longest_border() -> None:
    parts = merged_small(np.arange(3), _strip([1.0, 2.0], [50.0, 1.0, 50.0]), 0.05)

    assert parts[1] == parts[2] != parts[0]


def test_small_parts_together_do_not_become_a_segment() -> None:
    parts = merged_small(np.arange(6), _strip([1.0] * 5, [100.0, 4.0, 4.0, 4.0, 4.0, 100.0]), 0.05)

    assert len(np.unique(parts)) == 2


def test_a_long_strip_is_no_segment() -> None:
    parts = merged_small(np.arange(3), _strip([100.0, 90.0], [500.0, 100.0, 500.0]), 0.05)

    assert parts[1] == parts[0]


def test_crumbs_along_its_border_do_not_make_a_part_a_strip() -> None:
    surface = _strip([1.0, 1.0, 1.0, 200.0, 1.0], [500.0, 1e-3, 1e-3, 500.0, 1e-3, 500.0])

    parts = merged_small(np.array([0, 1, 2, 3, 4, 5]), surface, 0.01)

    assert len(np.unique(parts)) == 3


def test_samples_and_groups_spread_over_the_surface() -> None:
    mesh = refine(turned_mesh(((0, 0), (5, 0), (5, 20), (0, 20)), 32), 0.5)
    surface = surface_of(mesh)

    chosen, groups = sampled_faces(mesh, 1000), surface_groups(mesh, surface, 200)

    assert 600 < len(chosen) <= 1000
    assert len(np.unique(groups)) == groups.max() + 1 < 800
    assert surface.areas_mm2[np.isin(groups, groups[chosen])].sum() > 0.9 * surface.areas_mm2.sum()


def test_the_hull_of_flat_points_has_no_volume() -> None:
    rng = np.random.default_rng(0)
    flat = np.column_stack((rng.random((20, 2)), np.zeros(20)))

    assert hull_volume_mm3(flat) == 0.0
    assert hull_volume_mm3(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])) == pytest.approx(1 / 6)
