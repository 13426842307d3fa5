"""Threads are levelled for segmentation; teeth, grooves and fins stay, and no vertex of the mesh itself moves."""

import os
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import trimesh

from gripwright.design.stages.prepare import Prepared, PrepareSettings, prepare
from gripwright.domain.shape import Mesh
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.measures import face_areas_mm2
from gripwright.geometry.thread_relief import levelled_mm, threads
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.sdf import SdfSegmenter
from mesh_factory import SIX_STEPS, component_of, moved, plate_with_bosses, turned_mesh

SECTIONS, TURNS, PITCH, CREST, ROOT = 48, 8, 2.0, 8.0, 7.0
PROFILE = ((0.0, CREST), (0.125, CREST), (0.45, ROOT), (0.675, ROOT))  # share of the pitch, radius
REPOSITORY = Path(__file__).resolve().parents[2]
DATA = REPOSITORY.parent / "shared" / "data"
PUMP = REPOSITORY / "service" / "gripwright" / "samples" / "pump"


def _threaded(starts: int = 1) -> Mesh:
    """The thread of a rod about z, open at its ends, its edges along the helix."""
    turns = np.arange((TURNS + 1) * SECTIONS) / SECTIONS
    rows = [(start + share, radius) for start in range(starts) for share, radius in PROFILE]
    z = np.stack([turns * starts * PITCH + share * PITCH for share, _ in rows], axis=1)  # (steps, rows)
    r, a = np.array([radius for _, radius in rows]), 2.0 * np.pi * turns[:, None]
    vertices = np.stack((r * np.cos(a), r * np.sin(a), z), axis=2).reshape(-1, 3)
    number = np.arange(z.size).reshape(z.shape)
    above = np.concatenate((number[:, 1:], np.roll(number[:, :1], -SECTIONS, axis=0)), axis=1)  # the last row's is a turn on
    i = np.arange(TURNS * SECTIONS - 1)
    quads = np.stack((number[i], number[i + 1], above[i + 1], above[i]), axis=2).reshape(-1, 4)
    return Mesh(vertices_mm=vertices, faces=np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]])))


def _toothed(twist_deg: float) -> Mesh:
    """A gear of 24 teeth, 12 wide, straight or helical."""
    step = 2.0 * np.pi / 24
    outline = [
        (r * np.cos((k + s) * step), r * np.sin((k + s) * step))
        for k in range(24)
        for r, s in ((11.0, 0.0), (11.0, 0.3), (13.0, 0.4), (13.0, 0.6))
    ]
    solid = manifold3d.Manifold.extrude(manifold3d.CrossSection([outline]), 12.0, 12, twist_deg).to_mesh64()
    return Mesh(vertices_mm=np.array(solid.vert_properties[:, :3]), faces=np.array(solid.tri_verts, dtype=np.int64))


def _finned() -> Mesh:
    """A rod with many ring grooves: as fine as a thread, but no helix."""
    zigzag = [(8.0 if k % 2 else 7.0, float(k)) for k in range(1, 40)]
    return turned_mesh(((0.0, 0.0), (8.0, 0.0), *zigzag, (8.0, 40.0), (0.0, 40.0)), SECTIONS)


def _prepared(mesh: Mesh) -> Prepared:
    return prepare(mesh, PrepareSettings(), RunContext())


def _real(folder: Path, name: str) -> Mesh:
    path = folder / name
    if not path.exists():
        assert os.environ.get("CI") != "true", f"{path} is missing"
        pytest.skip(f"{path} is missing")
    file = trimesh.load(path, process=False)
    return Mesh(vertices_mm=np.array(file.vertices, dtype=float), faces=np.array(file.faces, dtype=np.int64))


@pytest.mark.parametrize("starts", [1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("internal", [False, True])
def test_a_thread_is_found_in_any_pose_of_either_hand_inside_or_outside(starts: int, mirrored: bool, internal: bool) -> None:
    plain = _threaded(starts)
    z = np.array([2.0, 3.0, 6.0]) / 7.0
    x = any_perpendicular(z)
    placed = moved(plain, pose(x, np.cross(z, x), z, np.array([10.0, -200.0, 5.0])))
    vertices = placed.vertices_mm * (-1.0 if mirrored else 1.0)
    mesh = Mesh(vertices_mm=vertices, faces=placed.faces[:, ::-1] if mirrored != internal else placed.faces)

    [thread] = threads(mesh)

    assert len(thread.faces) == len(mesh.faces)
    assert abs(thread.axis @ z) > np.cos(np.radians(1.5))
    assert thread.pitch_mm == pytest.approx(starts * PITCH, rel=0.15)


def test_a_thread_becomes_a_cylinder_of_its_mean_radius() -> None:
    mesh = _threaded()
    [thread] = threads(mesh)

    level = levelled_mm(mesh, thread)

    used = np.unique(mesh.faces)
    inner = used[(level[used, 2] > 2 * PITCH) & (level[used, 2] < (TURNS - 2) * PITCH)]
    radii = np.linalg.norm(level[inner, :2], axis=1)
    assert radii.min() > ROOT
    assert radii.max() < CREST
    assert np.ptp(radii) < 0.2 * (CREST - ROOT)
    np.testing.assert_allclose(level[inner, 2], mesh.vertices_mm[inner, 2], atol=0.1)


@pytest.mark.parametrize(
    "mesh",
    [_toothed(0.0), _toothed(30.0), _finned(), turned_mesh(SIX_STEPS, 64), plate_with_bosses(64)],
    ids=["gear", "helical gear", "fins", "shaft", "plate"],
)
def test_what_is_no_thread_does_not_move(mesh: Mesh) -> None:
    assert _prepared(mesh).mesh.smooth_vertices_mm is None


@pytest.mark.parametrize("name", ["gear.stl", "gear-block.stl", "rotor.stl", "front-cover.stl"])
def test_teeth_and_bores_of_the_sample_do_not_move(name: str) -> None:
    assert _prepared(_real(PUMP, name)).mesh.smooth_vertices_mm is None


@pytest.mark.parametrize(
    ("folder", "name"),
    [(PUMP, "shaft.stl"), (DATA / "bolt-nut-m16", "bolt-m16.stl"), (DATA / "bolt-nut-m16", "nut-m16.stl")],
    ids=["shaft", "bolt", "nut"],
)
def test_a_real_thread_lies_in_one_segment_and_the_mesh_itself_stays(folder: Path, name: str) -> None:
    prepared = _prepared(_real(folder, name))
    mesh, solid = prepared.mesh, prepared.solid
    assert mesh.smooth_vertices_mm is not None
    assert mesh.source_faces is not None
    assert solid.source_faces is not None

    segments = SdfSegmenter(SdfSegmenter.Settings()).segment(component_of(mesh), RunContext())

    [thread] = threads(solid)
    of_thread = np.isin(mesh.source_faces, solid.source_faces[thread.faces])
    areas = face_areas_mm2(mesh)
    assert max(areas[s.faces][of_thread[s.faces]].sum() for s in segments) > 0.98 * areas[of_thread].sum()
    still = np.setdiff1d(np.arange(len(mesh.vertices_mm)), mesh.faces[of_thread])
    np.testing.assert_array_equal(mesh.smooth_vertices_mm[still], mesh.vertices_mm[still])
    np.testing.assert_allclose(areas.sum(), face_areas_mm2(solid).sum(), rtol=1e-9)
