"""Cracks where one long edge meets several short ones are closed; nothing else changes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gripwright.domain.shape import IntArray, Mesh
from gripwright.geometry.adjacency import face_adjacency, open_half_edges
from gripwright.geometry.measures import face_areas_mm2, volume_mm3
from gripwright.geometry.mesh_repair import repair
from gripwright.geometry.t_junctions import without_t_junctions
from mesh_factory import box_mesh, moved, sphere_mesh


def cracked(places: list[list[float]]) -> Mesh:
    """A box one of whose sides' two triangles have corners at `places` (0..1) along each of the side's four edges."""
    box = box_mesh((30.0, 20.0, 10.0))
    top = np.flatnonzero((box.triangles_mm[:, :, 2] == box.vertices_mm[:, 2].max()).all(axis=1))
    ring = _outline(box.faces[top])
    vertices, corners = list(box.vertices_mm), []
    for k, along in enumerate(places):
        a, b = box.vertices_mm[ring[k]], box.vertices_mm[ring[(k + 1) % 4]]
        corners.append(ring[k])
        for share in sorted(set(along)):
            corners.append(len(vertices))
            vertices.append(a + share * (b - a))
    middle = len(vertices)
    vertices.append(box.vertices_mm[ring].mean(axis=0))
    fan = [(corners[i], corners[(i + 1) % len(corners)], middle) for i in range(len(corners))]
    faces = np.concatenate((np.delete(box.faces, top, axis=0), np.array(fan)))
    return Mesh(vertices_mm=np.array(vertices), faces=faces)


def _outline(pair: IntArray) -> list[int]:
    """The four corners of two triangles with a common side, in their sense."""
    sides = [(int(f[k]), int(f[(k + 1) % 3])) for f in pair for k in range(3)]
    following = {a: b for a, b in sides if (b, a) not in sides}
    ring = [min(following)]
    while len(ring) < 4:
        ring.append(following[ring[-1]])
    return ring


SHARES = st.lists(st.sampled_from([0.1, 0.25, 0.4, 0.5, 0.75, 0.9]), max_size=5)


@given(places=st.lists(SHARES, min_size=4, max_size=4))
def test_any_corners_along_the_edges_of_a_side_are_joined_to_the_sides_around_it(places: list[list[float]]) -> None:
    mesh = cracked(places)

    whole, divided = without_t_junctions(mesh)

    assert not len(open_half_edges(whole)[0])
    assert face_adjacency(whole).non_manifold_edges == 0
    assert divided == sum(bool(along) for along in places)
    assert volume_mm3(whole) == pytest.approx(6000.0)
    np.testing.assert_array_equal(whole.vertices_mm, mesh.vertices_mm)
    areas = np.bincount(whole.source_faces, face_areas_mm2(whole), len(mesh.faces))
    np.testing.assert_allclose(areas, face_areas_mm2(mesh))


def test_a_turned_and_shifted_crack_is_closed_in_spite_of_rounding() -> None:
    X = np.eye(4)
    X[:3, :3] = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    X[:3, 3] = 1000.0, -70.0, 3.0

    done = repair(moved(cracked([[0.1, 0.3, 0.9], [0.5], [], [0.2, 0.8]]), X))

    assert (done.open_edges, done.divided_faces) == (0, 3)
    assert volume_mm3(done.mesh) == pytest.approx(6000.0)


def test_a_hole_stays_a_hole() -> None:
    sphere = sphere_mesh(5.0, 32)
    holed = Mesh(vertices_mm=sphere.vertices_mm, faces=sphere.faces[3:])

    whole, divided = without_t_junctions(holed)

    assert divided == 0
    np.testing.assert_array_equal(whole.faces, holed.faces)
