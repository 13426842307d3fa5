"""Segmentation by surfaces: bodies and hollows that an engineer would draw, whatever the tessellation."""

import pickle

import manifold3d
import numpy as np
import pytest
from scipy.spatial import cKDTree

from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.domain.shape import FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.frames import pose
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, face_normals
from gripwright.geometry.refine import refine
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.primitives import PrimitivesSegmenter
from mesh_factory import (
    SIX_STEPS,
    STEPPED_SHAFT,
    box_mesh,
    component_of,
    filleted_boss,
    housing,
    mesh_of,
    moved,
    soup,
    turned_mesh,
)

Manifold = manifold3d.Manifold
Settings = PrimitivesSegmenter.Settings

CONE_ON_CYLINDER = ((0.0, 0.0), (12.0, 0.0), (12.0, 30.0), (3.0, 48.0), (0.0, 48.0))
CHAMFERED_BOSS = ((0.0, 0.0), (30.0, 0.0), (30.0, 8.0), (13.0, 8.0), (12.0, 9.0), (12.0, 29.0), (11.0, 30.0), (0.0, 30.0))


def plate_with_four_bosses(sections: int) -> Mesh:
    """A plate 120 × 80 × 12 with four bosses of radius 6, as high as the plate is thick, and two bores of radius 14."""
    solid = Manifold.cube((120.0, 80.0, 12.0))
    for x in (15.0, 105.0):
        for y in (15.0, 65.0):
            solid += Manifold.cylinder(14.0, 6.0, 6.0, sections).translate((x, y, 10.0))
    for x in (40.0, 80.0):
        solid -= Manifold.cylinder(30.0, 14.0, 14.0, sections).translate((x, 40.0, -5.0))
    return mesh_of(solid)


def knob(sections: int) -> Mesh:
    """A ball of radius 12 on a pin of radius 5."""
    return mesh_of(Manifold.cylinder(40.0, 5.0, 5.0, sections) + Manifold.sphere(12.0, sections).translate((0.0, 0.0, 48.0)))


def toothed(teeth: int) -> Mesh:
    """A toothed wheel of radius 20 to 24 on a hub of radius 14, with a bore of radius 6."""
    step = 2.0 * np.pi / teeth
    turns = np.array([(k + part) * step for k in range(teeth) for part in (0.0, 0.15, 0.45, 0.6)])
    radii = np.tile([20.0, 24.0, 24.0, 20.0], teeth)
    outline = manifold3d.CrossSection([np.stack((radii * np.cos(turns), radii * np.sin(turns)), axis=1)])
    wheel = Manifold.extrude(outline, 10.0) + Manifold.cylinder(25.0, 14.0, 14.0, 64)
    return mesh_of(wheel - Manifold.cylinder(60.0, 6.0, 6.0, 64).translate((0.0, 0.0, -20.0)))


def _prepared(mesh: Mesh) -> Mesh:
    return prepare(mesh, PrepareSettings(), RunContext()).mesh


def _segments(mesh: Mesh, ctx: RunContext | None = None) -> list[Segment]:
    return list(PrimitivesSegmenter(Settings()).segment(component_of(mesh), ctx or RunContext()))


def _labels(mesh: Mesh) -> IntArray:
    labels = np.full(len(mesh.faces), -1)
    for segment in _segments(mesh):
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
    return _rand_index(_labels(one), _labels(other)[nearest], face_areas_mm2(one))


GROOVED = ((0.0, 0.0), (30.0, 0.0), (30.0, 8.0), (24.0, 8.0), (24.0, 9.0), (30.0, 9.0), (30.0, 20.0), (0.0, 20.0))

SOLIDS = {
    "box": (box_mesh((30.0, 20.0, 10.0)), 1),
    "shaft": (turned_mesh(STEPPED_SHAFT, 32), 2),
    "six steps": (turned_mesh(SIX_STEPS, 48), 6),
    "plate with four bosses and two bores": (plate_with_four_bosses(32), 7),
    "housing: outside, inside, seat, bore": (housing(48), 4),
    "cone on cylinder": (turned_mesh(CONE_ON_CYLINDER, 48), 1),
    "ball on pin": (knob(48), 2),
    "chamfered boss on disc": (turned_mesh(CHAMFERED_BOSS, 48), 2),
    "two flanges with a narrow groove between": (turned_mesh(GROOVED, 64), 2),
    "toothed wheel with its hub and bore": (toothed(30), 3),
    "filleted boss on disc": (filleted_boss(48), 2),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_convex_bodies_and_hollows_are_segments(name: str) -> None:
    mesh, count = SOLIDS[name]

    assert len(_segments(_prepared(mesh))) == count


def test_a_boss_is_one_segment_with_its_end_face_and_a_bore_is_one_without_the_plate() -> None:
    mesh = _prepared(plate_with_four_bosses(48))
    centres, normals = face_centres_mm(mesh), face_normals(mesh)
    expected = np.zeros(len(centres), dtype=np.int64)
    above = centres[:, 2] > 12.0 + 1e-9
    expected[above] = 1 + (centres[above, 0] > 60.0) + 2 * (centres[above, 1] > 40.0)
    inside = (np.abs(normals[:, 2]) < 0.1) & (np.abs(centres[:, 0] - 60.0) < 35.0) & (np.abs(centres[:, 1] - 40.0) < 15.0)
    expected[inside] = 5 + (centres[inside, 0] > 60.0)

    assert _rand_index(_labels(mesh), expected, face_areas_mm2(mesh)) > 0.999


def test_the_inside_of_a_housing_is_one_segment_that_faces_itself() -> None:
    mesh = _prepared(housing(48))
    centres = face_centres_mm(mesh)
    inside = (np.abs(centres[:, 0] - 40.0) < 36.1) & (np.abs(centres[:, 1] - 30.0) < 26.1) & (centres[:, 2] > 3.9)
    labels = _labels(mesh)

    assert len(np.unique(labels[inside & (centres[:, 2] < 39.9)])) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (turned_mesh(SIX_STEPS, 24), turned_mesh(SIX_STEPS, 160)),
        (turned_mesh(SIX_STEPS, 400), turned_mesh(SIX_STEPS, 60)),  # long thin triangles
        (turned_mesh(SIX_STEPS, 24), turned_mesh(SIX_STEPS, 60, ring_mm=2.0)),
        (plate_with_four_bosses(20), plate_with_four_bosses(150)),
        (plate_with_four_bosses(40), refine(plate_with_four_bosses(40), 2.5)),
        (housing(20), housing(120)),
        (turned_mesh(CONE_ON_CYLINDER, 20), turned_mesh(CONE_ON_CYLINDER, 160)),
        (knob(24), knob(96)),
        (filleted_boss(24), filleted_boss(128)),
    ],
    ids=["coarse-fine", "slivers", "rings", "plate", "plate-refined", "housing", "cone", "knob", "fillet"],
)
def test_the_tessellation_does_not_decide_the_segments(one: Mesh, other: Mesh) -> None:
    assert _agreement(one, other) >= 0.97


def test_a_rigid_motion_does_not_change_the_segments() -> None:
    mesh = plate_with_four_bosses(32)
    X = pose(np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.8, -0.6, 0.0]), np.array([500.0, -90.0, 7.0]))
    still, turned = _prepared(mesh), _prepared(moved(mesh, X))

    assert _rand_index(_labels(still), _labels(turned), face_areas_mm2(still)) > 0.99


def test_the_unit_does_not_change_the_segments() -> None:
    mesh = _prepared(knob(48))
    large = Mesh(vertices_mm=mesh.vertices_mm * 1000.0, faces=mesh.faces)

    assert _rand_index(_labels(mesh), _labels(large), face_areas_mm2(mesh)) > 0.99


def test_the_order_of_faces_and_vertices_does_not_change_the_segments() -> None:
    mesh = soup(housing(32))
    order = np.random.default_rng(5).permutation(len(mesh.faces))
    shuffled = soup(Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[order]))

    assert _agreement(mesh, shuffled) > 0.99


def test_a_rough_surface_has_the_segments_of_the_smooth_one() -> None:
    mesh = turned_mesh(SIX_STEPS, 72, ring_mm=2.5)
    noise = np.random.default_rng(3).normal(scale=0.001 * 100.0, size=mesh.vertices_mm.shape)
    rough = Mesh(vertices_mm=mesh.vertices_mm + noise, faces=mesh.faces)

    assert _rand_index(_labels(mesh), _labels(rough), face_areas_mm2(mesh)) > 0.97


def test_the_same_input_gives_the_same_segments_and_stays_unchanged() -> None:
    mesh = _prepared(knob(32))
    vertices, faces = mesh.vertices_mm.copy(), mesh.faces.copy()

    first, second = _segments(mesh), _segments(mesh)

    assert pickle.dumps(first) == pickle.dumps(second)
    np.testing.assert_array_equal(mesh.vertices_mm, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)


@pytest.mark.parametrize(
    ("mesh", "surfaces"),
    [
        (box_mesh((30.0, 20.0, 10.0)), "6 planes;"),
        (turned_mesh(CONE_ON_CYLINDER, 48), "2 planes, 1 cylinder, 1 cone;"),
        (knob(48), "1 plane, 1 cylinder, 1 sphere;"),
        (plate_with_four_bosses(32), "6 planes, 6 cylinders;"),
    ],
    ids=["box", "cone", "knob", "plate"],
)
def test_the_remark_counts_the_surfaces_that_are_no_details(mesh: Mesh, surfaces: str) -> None:
    ctx = RunContext()

    _segments(_prepared(mesh), ctx)

    (remark,) = ctx.remarks
    assert surfaces in remark
    assert "explain 100 %" in remark
