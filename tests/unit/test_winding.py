"""Faces are turned only where neighbours disagree or the shape says so, on open meshes too."""

import os
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import trimesh

from gripwright.domain.shape import Mesh
from gripwright.geometry.adjacency import connected_labels, two_face_edges
from gripwright.geometry.measures import face_centres_mm, face_normals
from gripwright.geometry.winding import inward_faces
from mesh_factory import box_mesh

SECTIONS = 48
NUT = Path(__file__).resolve().parents[3] / "shared" / "data" / "bolt-nut-m16" / "nut-m16.stl"


def _grooved_ring() -> Mesh:
    """A ring about z whose bore has grooves, as a nut's: outer radius 12, inner 7 to 8, height 13."""
    groove = [(8.0 if k % 2 else 7.0, -6.0 + k) for k in range(13)]
    profile = [(7.0, -6.5), (12.0, -6.5), (12.0, 6.5), (7.0, 6.5), *reversed(groove)]
    found = manifold3d.Manifold.revolve(manifold3d.CrossSection([profile]), SECTIONS).to_mesh64()
    return Mesh(vertices_mm=np.array(found.vert_properties[:, :3]), faces=np.array(found.tri_verts, dtype=np.int64))


def _cut_ring() -> Mesh:
    """The ring with a narrow gap all round near either end of its bore: the grooves are an open body of their own."""
    ring = _grooved_ring()
    heights, radii = ring.triangles_mm[:, :, 2], np.linalg.norm(ring.triangles_mm[:, :, :2], axis=2)
    gap = ((np.abs(heights) > 5.9) & (radii < 7.1)).all(axis=1)
    return Mesh(vertices_mm=ring.vertices_mm, faces=ring.faces[~gap])


def _with_turned(mesh: Mesh, turned: np.ndarray) -> Mesh:
    return Mesh(vertices_mm=mesh.vertices_mm, faces=np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))


def test_the_ring_of_these_tests_is_open_and_its_bore_apart() -> None:
    ring = _cut_ring()
    pairs, against = two_face_edges(ring)

    assert against.all()
    assert connected_labels(pairs, len(ring.faces)).max() == 1
    assert 3 * len(ring.faces) - 2 * len(pairs) == 4 * SECTIONS


@pytest.mark.parametrize("by", [(0.0, 0.0), (300.0, 0.0), (300.0, 300.0)])
def test_no_face_of_an_open_mesh_that_is_right_is_turned(by: tuple[float, float]) -> None:
    ring = _cut_ring()

    assert not inward_faces(Mesh(vertices_mm=ring.vertices_mm + np.array((*by, -40.0)), faces=ring.faces)).any()


def test_all_faces_of_an_inside_out_open_mesh_are_turned() -> None:
    ring = _cut_ring()

    assert inward_faces(_with_turned(ring, np.ones(len(ring.faces), dtype=bool))).all()


def test_an_open_body_alone_that_is_inside_out_is_turned() -> None:
    ring = _cut_ring()
    pairs, _ = two_face_edges(ring)
    turned = connected_labels(pairs, len(ring.faces)) == 1

    np.testing.assert_array_equal(inward_faces(_with_turned(ring, turned)), turned)


@pytest.mark.parametrize("seed", range(5))
def test_half_of_the_faces_turned_at_random_are_found(seed: int) -> None:
    ring = _cut_ring()
    turned = np.random.default_rng(seed).random(len(ring.faces)) < 0.5

    np.testing.assert_array_equal(inward_faces(_with_turned(ring, turned)), turned)


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_box_without_a_lid_looks_outward(inside_out: bool) -> None:
    box = box_mesh((30.0, 20.0, 10.0))
    lid = (box.triangles_mm[:, :, 2] == 10.0).all(axis=1)
    faces = box.faces[~lid][:, ::-1] if inside_out else box.faces[~lid]

    assert (inward_faces(Mesh(vertices_mm=box.vertices_mm, faces=faces)) == inside_out).all()


def test_many_loose_triangles_are_judged_in_bounded_time() -> None:
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(5000, 1, 3)) * 100.0 + rng.normal(size=(5000, 3, 3))

    flips = inward_faces(Mesh(vertices_mm=corners.reshape(-1, 3), faces=np.arange(15000).reshape(-1, 3)))

    assert flips.shape == (5000,)


def test_the_thread_of_a_real_open_nut_keeps_looking_at_its_axis() -> None:
    if not NUT.exists():
        assert os.environ.get("CI") != "true", f"{NUT} is missing"
        pytest.skip(f"{NUT} is missing")
    file = trimesh.load(NUT)  # vertices merged
    mesh = Mesh(vertices_mm=np.array(file.vertices, dtype=float), faces=np.array(file.faces, dtype=np.int64))

    flips = inward_faces(mesh)
    inside_out = inward_faces(_with_turned(mesh, np.ones(len(mesh.faces), dtype=bool)))

    assert not flips.any()
    assert inside_out.all()
    centres = face_centres_mm(mesh)
    bore = np.linalg.norm(centres[:, :2], axis=1) < 9.0
    assert (np.einsum("ij,ij->i", face_normals(mesh)[bore, :2], centres[bore, :2]) < 0).mean() > 0.9
