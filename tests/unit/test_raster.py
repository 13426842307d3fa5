import numpy as np
import trimesh

from gripwright.geometry.raster import NOTHING, first_seen
from gripwright.geometry.rays import RayScene


def test_rays_hit_the_faces_that_are_seen() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=18.0)
    ring = trimesh.creation.annulus(r_min=6.0, r_max=25.0, height=9.0)
    ring.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1.0, 0.4, 0.2]))
    mesh = trimesh.util.concatenate([ball, ring])
    mesh.apply_translation([30.21, 29.63, 50.0])

    face, depth = first_seen(mesh.triangles, 60, 62)

    scene = RayScene(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    rows, columns = np.mgrid[:60, :62]
    origins = scene.centred(np.stack([columns, rows, np.zeros((60, 62))], axis=-1).reshape(-1, 3))
    directions = np.tile(np.float32([0.0, 0.0, 1.0]), (len(origins), 1))
    far, hit, _ = (found.reshape(60, 62, *found.shape[1:]) for found in scene.first_hits(origins, directions))
    assert (hit >= 0).sum() > 1000
    assert np.mean((hit >= 0) != (face >= 0)) < 0.002  # on the outline itself
    both = (hit >= 0) & (face >= 0)
    assert np.mean(hit[both] != face[both]) < 0.01  # on edges
    assert np.mean(np.abs(far[both] - depth[both]) > 1e-3) < 0.002


def test_faces_side_by_side_leave_no_gap_and_share_no_sample() -> None:
    square = np.array([[2.0, 3.0, 0.0], [37.0, 3.0, 0.0], [37.0, 38.0, 0.0], [2.0, 38.0, 0.0]])
    middle = np.array([21.0, 13.0, 0.0])  # on a sample, as the corners are
    fan = [np.array([middle, square[i], square[(i + 1) % 4]]) for i in range(4)]

    covered = np.sum([first_seen(face[None], 41, 41)[0] != NOTHING for face in fan], axis=0)

    assert covered.max() == 1
    assert covered.sum() == 35 * 35
    assert (covered[3:38, 2:37] == 1).all()


def test_nothing_is_seen_of_a_face_edge_on_or_beside_the_picture() -> None:
    edge_on = np.array([[1.0, 1.0, 0.0], [8.0, 8.0, 1.0], [4.0, 4.0, 5.0]])
    beside = np.array([[21.0, 1.0, 0.0], [28.0, 8.0, 1.0], [27.0, 4.0, 5.0]])

    face, depth = first_seen(np.array([edge_on, beside]), 10, 10)

    assert (face == NOTHING).all()
    assert np.isinf(depth).all()
