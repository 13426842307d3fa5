"""Segmentation by shape diameter: partitions that an engineer would draw, whatever the tessellation."""

import pickle
import re

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.domain.shape import FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.frames import pose
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, face_normals
from gripwright.geometry.mesh_repair import repaired
from gripwright.geometry.refine import refine
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.sdf import SdfSegmenter
from gripwright_builtin.segmenters.soft_clustering import cluster_count
from mesh_factory import (
    SIX_STEPS,
    STEPPED_SHAFT,
    box_mesh,
    component_of,
    filleted_boss,
    moved,
    plate_with_bosses,
    soup,
    sphere_mesh,
    turned_mesh,
)

Settings = SdfSegmenter.Settings


def _prepared(mesh: Mesh) -> Mesh:
    return prepare(mesh, PrepareSettings(), RunContext()).mesh


def _segments(mesh: Mesh, settings: Settings | None = None) -> list[Segment]:
    return list(SdfSegmenter(settings or Settings()).segment(component_of(mesh), RunContext()))


def _labels(mesh: Mesh, segments: list[Segment]) -> IntArray:
    labels = np.full(len(mesh.faces), -1)
    for segment in segments:
        labels[segment.faces] = segment.id
    return labels


def _rand_index(first: IntArray, second: IntArray, weights: FloatArray) -> float:
    table = np.zeros((first.max() + 1, second.max() + 1))
    np.add.at(table, (first, second), weights / weights.sum())
    return float(1.0 - (table.sum(axis=0) ** 2).sum() - (table.sum(axis=1) ** 2).sum() + 2.0 * (table**2).sum())


def _agreement(one: Mesh, other: Mesh) -> float:
    """Rand index of the segmentations of two meshes of one solid, labels carried by nearest face that looks the same way."""
    one, other = _prepared(one), _prepared(other)
    scale = 0.05 * np.linalg.norm(np.ptp(one.vertices_mm, axis=0))
    places = [np.hstack((face_centres_mm(m), face_normals(m) * scale)) for m in (one, other)]
    nearest = cKDTree(places[1]).query(places[0])[1]
    return _rand_index(_labels(one, _segments(one)), _labels(other, _segments(other))[nearest], face_areas_mm2(one))


MESHES = {
    "box": box_mesh((30.0, 20.0, 10.0)),
    "sphere": sphere_mesh(10.0, 32),
    "shaft": turned_mesh(STEPPED_SHAFT, 32),
    "six steps": turned_mesh(SIX_STEPS, 48),
    "plate": plate_with_bosses(32),
}


@pytest.mark.parametrize("energy", ["area", "published"])
@pytest.mark.parametrize("name", MESHES)
def test_every_face_is_in_exactly_one_segment(name: str, energy: str) -> None:
    mesh = _prepared(MESHES[name])

    segments = _segments(mesh, Settings(energy=energy, rays=12))

    assert [s.id for s in segments] == list(range(len(segments)))
    np.testing.assert_array_equal(np.sort(np.concatenate([s.faces for s in segments])), np.arange(len(mesh.faces)))
    assert all((np.diff(s.faces) > 0).all() for s in segments)
    assert sum(s.area_mm2 for s in segments) == pytest.approx(face_areas_mm2(mesh).sum())


@pytest.mark.parametrize(("name", "count"), [("box", 1), ("sphere", 1), ("shaft", 2), ("six steps", 6), ("plate", 4)], ids=str)
def test_steps_bosses_and_bores_are_segments_and_plain_solids_are_one(name: str, count: int) -> None:
    assert len(_segments(_prepared(MESHES[name]))) == count


@pytest.mark.parametrize(("name", "count"), [("box", 1), ("sphere", 1), ("shaft", 2), ("six steps", 6), ("plate", 4)], ids=str)
def test_a_number_of_clusters_chosen_by_the_criterion_gives_the_same_segments_and_is_said(name: str, count: int) -> None:
    ctx = RunContext()

    segments = SdfSegmenter(Settings(clusters="auto")).segment(component_of(_prepared(MESHES[name])), ctx)

    assert len(segments) == count
    assert re.fullmatch(r"\d levels of thickness, by the Bayesian information criterion", ctx.remarks[0])


@pytest.mark.parametrize("levels", [1, 2, 3, 6])
def test_the_criterion_counts_levels_that_are_apart(levels: int) -> None:
    rng = np.random.default_rng(levels)
    values = np.clip(np.concatenate([rng.normal(middle, 0.02, 4000) for middle in (np.arange(levels) + 0.5) / levels]), 0.0, 1.0)

    assert cluster_count(values, np.ones_like(values), common_spread=True) == levels


def test_each_step_of_a_shaft_is_one_segment_with_its_end_face() -> None:
    mesh = _prepared(turned_mesh(STEPPED_SHAFT, 48))
    thin = (face_centres_mm(mesh)[:, 2] > 20.0 + 1e-9).astype(np.int64)

    assert _rand_index(_labels(mesh, _segments(mesh)), thin, face_areas_mm2(mesh)) > 0.999


@pytest.mark.parametrize(("sections", "edge_mm"), [(24, 40.0), (48, 1.5), (96, 3.0)])
def test_a_boss_that_a_fillet_leads_to_is_a_segment(sections: int, edge_mm: float) -> None:
    mesh = _prepared(refine(filleted_boss(sections), edge_mm))

    segments = _segments(mesh)

    upper = (face_centres_mm(mesh)[:, 2] > 9.5).astype(np.int64)
    assert len(segments) == 2
    assert _rand_index(_labels(mesh, segments), upper, face_areas_mm2(mesh)) > 0.95


def test_a_crease_blurred_over_several_edges_divides_as_the_sharp_one_does() -> None:
    sharp = repaired(refine(turned_mesh(SIX_STEPS, 64), 2.0))
    blurred = trimesh.Trimesh(sharp.vertices_mm, sharp.faces, process=False)
    trimesh.smoothing.filter_laplacian(blurred, lamb=0.5, iterations=2, volume_constraint=False)

    assert _agreement(turned_mesh(SIX_STEPS, 64), Mesh(vertices_mm=np.array(blurred.vertices), faces=sharp.faces)) >= 0.97


def test_hull_volume_is_that_of_the_segments_points() -> None:
    mesh = _prepared(turned_mesh(STEPPED_SHAFT, 256))

    wide, thin = _segments(mesh)

    assert wide.hull_volume_mm3 == pytest.approx(np.pi * 100.0 * 20.0, rel=1e-3)
    assert thin.hull_volume_mm3 == pytest.approx(np.pi * 25.0 * 25.0, rel=1e-3)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (turned_mesh(SIX_STEPS, 24), turned_mesh(SIX_STEPS, 160)),
        (turned_mesh(SIX_STEPS, 24), turned_mesh(SIX_STEPS, 60, ring_mm=2.0)),
        (turned_mesh(SIX_STEPS, 400), turned_mesh(SIX_STEPS, 60)),  # long thin triangles
        (plate_with_bosses(24), plate_with_bosses(150)),
        (plate_with_bosses(40), refine(plate_with_bosses(40), 1.5)),
    ],
    ids=["coarse-fine", "coarse-rings", "slivers", "plate", "plate-refined"],
)
def test_the_tessellation_does_not_decide_the_segments(one: Mesh, other: Mesh) -> None:
    assert _agreement(one, other) >= 0.97


def test_a_rigid_motion_does_not_change_the_segments() -> None:
    mesh = turned_mesh(SIX_STEPS, 48)
    X = pose(np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.8, -0.6, 0.0]), np.array([500.0, -90.0, 7.0]))
    still, turned = _prepared(mesh), _prepared(moved(mesh, X))

    assert _rand_index(_labels(still, _segments(still)), _labels(turned, _segments(turned)), face_areas_mm2(still)) > 0.99


def test_the_order_of_faces_and_vertices_does_not_change_the_segments() -> None:
    mesh = soup(plate_with_bosses(32))
    order = np.random.default_rng(5).permutation(len(mesh.faces))
    shuffled = soup(Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[order]))

    assert _agreement(mesh, shuffled) > 0.99


def test_the_unit_does_not_change_the_segments() -> None:
    mesh = _prepared(turned_mesh(STEPPED_SHAFT, 32))
    large = Mesh(vertices_mm=mesh.vertices_mm * 1000.0, faces=mesh.faces)

    assert _rand_index(_labels(mesh, _segments(mesh)), _labels(large, _segments(large)), face_areas_mm2(mesh)) > 0.99


def test_the_same_input_gives_the_same_segments_and_stays_unchanged() -> None:
    mesh = _prepared(plate_with_bosses(32))
    vertices, faces = mesh.vertices_mm.copy(), mesh.faces.copy()

    first, second = _segments(mesh), _segments(mesh)

    assert pickle.dumps(first) == pickle.dumps(second)
    np.testing.assert_array_equal(mesh.vertices_mm, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)


def test_a_sample_of_the_faces_gives_the_segments_of_all() -> None:
    mesh = refine(turned_mesh(SIX_STEPS, 64), 3.0)

    every, some = _segments(mesh), _segments(mesh, Settings(samples=2000))

    assert len(mesh.faces) > 20_000
    assert _rand_index(_labels(mesh, every), _labels(mesh, some), face_areas_mm2(mesh)) > 0.98


def test_an_open_mesh_is_segmented_like_the_closed_one() -> None:
    closed = turned_mesh(STEPPED_SHAFT, 48)
    opened = Mesh(vertices_mm=closed.vertices_mm, faces=np.delete(closed.faces, [50, 51, 120], axis=0))

    assert len(_segments(_prepared(opened))) == 2


def test_phases_are_timed_apart() -> None:
    ctx = RunContext()

    SdfSegmenter(Settings()).segment(component_of(_prepared(box_mesh((1.0, 2.0, 3.0)))), ctx)

    assert {"segment.rays", "segment.smooth", "segment.cluster", "segment.cut", "segment.components"} <= ctx.timings.keys()
