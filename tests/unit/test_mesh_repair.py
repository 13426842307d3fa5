"""A file's triangles become one consistently wound solid, or are refused with the measured reason."""

import numpy as np
import pytest

from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import Mesh
from gripwright.geometry.adjacency import exterior_angles_rad, face_adjacency
from gripwright.geometry.measures import volume_mm3
from gripwright.geometry.mesh_repair import repair, repaired
from mesh_factory import STEPPED_SHAFT, box_mesh, soup, sphere_mesh, turned_mesh


def _with_faces(mesh: Mesh, faces: np.ndarray) -> Mesh:
    return Mesh(vertices_mm=mesh.vertices_mm, faces=np.asarray(faces, dtype=np.int64))


def _together(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(m.vertices_mm) for m in meshes)])
    return Mesh(
        vertices_mm=np.concatenate([m.vertices_mm for m in meshes]),
        faces=np.concatenate([m.faces + start for m, start in zip(meshes, starts, strict=False)]),
    )


def _shifted(mesh: Mesh, by: tuple[float, float, float]) -> Mesh:
    return Mesh(vertices_mm=mesh.vertices_mm + np.array(by), faces=mesh.faces)


def test_vertices_of_equal_coordinates_become_one() -> None:
    mesh = soup(turned_mesh(STEPPED_SHAFT, 24))

    done = repair(mesh)

    assert done.open_edges == 0
    assert len(done.mesh.vertices_mm) - 1.5 * len(done.mesh.faces) + len(done.mesh.faces) == 2  # Euler's formula
    np.testing.assert_array_equal(done.mesh.triangles_mm, mesh.triangles_mm[done.mesh.source_faces])


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 1.0])
def test_whatever_part_of_the_faces_is_turned_round_the_result_points_outward(share: float) -> None:
    mesh = turned_mesh(STEPPED_SHAFT, 24)
    turned = np.random.default_rng(1).random(len(mesh.faces)) < share

    done = repair(_with_faces(mesh, np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)))

    assert done.flipped_faces == turned.sum()
    assert volume_mm3(done.mesh) == pytest.approx(volume_mm3(mesh), rel=1e-12)


def test_a_cavity_stays_a_cavity_and_a_second_body_a_body() -> None:
    outer, cavity = box_mesh((10, 10, 10)), _shifted(box_mesh((2, 2, 2)), (4, 4, 4))
    hollow = _together(outer, _with_faces(cavity, cavity.faces[:, ::-1]), _shifted(outer, (20, 0, 0)))

    as_is = repair(hollow)
    inside_out = repair(_with_faces(hollow, hollow.faces[:, ::-1]))

    assert as_is.flipped_faces == 0
    assert volume_mm3(as_is.mesh) == pytest.approx(2000 - 8)
    assert volume_mm3(inside_out.mesh) == pytest.approx(2000 - 8)


def test_degenerate_and_double_faces_go_and_the_others_keep_their_number() -> None:
    box = box_mesh((1, 2, 3))
    faces = np.concatenate((box.faces[:5], [[0, 0, 1], [3, 3, 3]], box.faces[5:], box.faces[2:3], [[0, 1, 2], [2, 1, 0]]))

    done = repair(_with_faces(box, faces))

    assert done.degenerate_faces == 5
    np.testing.assert_array_equal(done.mesh.source_faces, [0, 1, 2, 3, 4, *range(7, 14)])
    assert volume_mm3(done.mesh) == pytest.approx(6.0)


def test_an_open_edge_is_counted() -> None:
    sphere = sphere_mesh(5.0, 32)

    assert repair(_with_faces(sphere, sphere.faces[1:])).open_edges == 3


def test_two_boxes_that_touch_along_an_edge_stay_apart() -> None:
    mesh = repaired(_together(box_mesh((1, 1, 1)), _shifted(box_mesh((1, 1, 1)), (1, 1, 0))))

    adjacency = face_adjacency(mesh)

    assert adjacency.non_manifold_edges == 1
    assert len(adjacency.pairs) == 36
    assert not ((adjacency.pairs < 12).sum(axis=1) == 1).any()
    assert exterior_angles_rad(mesh, adjacency).min() >= -1e-12


def test_exterior_angles_are_positive_at_convex_and_negative_at_concave_edges() -> None:
    mesh = repaired(turned_mesh(STEPPED_SHAFT, 64))
    adjacency = face_adjacency(mesh)

    angles = np.degrees(exterior_angles_rad(mesh, adjacency))

    heights = mesh.vertices_mm[adjacency.edges][:, :, 2]
    radii = np.linalg.norm(mesh.vertices_mm[adjacency.edges][:, :, :2], axis=2)
    crease = ((heights == 20.0) & (np.abs(radii - 5.0) < 1e-9)).all(axis=1)
    assert crease.sum() == 64
    np.testing.assert_allclose(angles[crease], -90.0, atol=1e-6)
    assert angles[~crease].min() > -1e-6


@pytest.mark.parametrize(
    ("mesh", "reason"),
    [
        (Mesh(vertices_mm=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int64)), "no faces"),
        (_with_faces(box_mesh((1, 1, 1)), box_mesh((1, 1, 1)).faces + 1), "names vertex 8"),
        (Mesh(vertices_mm=np.where(np.arange(24).reshape(8, 3) == 5, np.nan, box_mesh((1, 1, 1)).vertices_mm),
              faces=box_mesh((1, 1, 1)).faces), "1 of 8 vertices"),
        (_with_faces(box_mesh((1, 1, 1)), np.array([[0, 0, 1], [2, 3, 2]])), "degenerate"),
        (_with_faces(box_mesh((1, 1, 1)), box_mesh((1, 1, 1)).faces[:4]), "mostly open"),
        (Mesh(vertices_mm=box_mesh((1, 1, 1)).vertices_mm * [1, 1, 0], faces=box_mesh((1, 1, 1)).faces), "no"),
    ],
)  # fmt: skip
def test_what_encloses_nothing_is_refused_with_the_measured_reason(mesh: Mesh, reason: str) -> None:
    with pytest.raises(InvalidGeometry, match=reason):
        repair(mesh)
