"""How far a mesh reaches into a convex solid, against closed forms."""

import numpy as np
import pytest

from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import inverse, pose
from gripwright.geometry.penetration import Halfspaces, Triangles, penetration, surface_penetration
from gripwright.geometry.solids import box_vertices, prism_vertices
from mesh_factory import box_mesh, moved

SOLID = box_vertices(np.array([0.0, -5.0, -40.0]), np.array([8.0, 5.0, 0.0]))  # as a finger
HERE = np.eye(4)


def placed(size: tuple[float, float, float], low: tuple[float, float, float]) -> Triangles:
    X = np.eye(4)
    X[:3, 3] = low
    return Triangles(moved(box_mesh(size), X))


@pytest.mark.parametrize(
    ("low", "depth", "normal"),
    [
        ((6.2, -20.0, -60.0), 1.8, (1.0, 0.0, 0.0)),  # a wall outside
        ((-90.0, 3.5, -60.0), 1.5, (0.0, 1.0, 0.0)),  # beside it
        ((-50.0, -50.0, -0.25), 0.25, (0.0, 0.0, 1.0)),  # a floor below its tip
    ],
)
def test_a_block_reaches_in_as_far_as_it_overlaps_behind_the_nearest_face(
    low: tuple[float, float, float], depth: float, normal: tuple[float, float, float]
) -> None:
    found = penetration(Halfspaces(SOLID), placed((100.0, 100.0, 100.0), low), HERE)

    assert found is not None
    assert found.depth_mm == pytest.approx(depth, abs=1e-9)
    assert found.normal == pytest.approx(normal)


def test_what_lies_beside_it_does_not_reach_in() -> None:
    assert penetration(Halfspaces(SOLID), placed((5.0, 5.0, 5.0), (8.01, 0.0, -10.0)), HERE) is None


def test_a_solid_wholly_inside_a_block_is_as_deep_as_it_is_thin_and_its_surface_alone_does_not_tell() -> None:
    block = placed((100.0, 100.0, 100.0), (-50.0, -50.0, -70.0))

    found = penetration(Halfspaces(SOLID), block, HERE)

    assert found is not None
    assert found.depth_mm == pytest.approx(8.0)
    assert surface_penetration(Halfspaces(SOLID), block, HERE) is None


def test_a_pin_right_through_is_led_out_by_the_side_it_is_nearest_to() -> None:
    found = penetration(Halfspaces(SOLID), placed((100.0, 1.0, 1.0), (-50.0, 2.0, -20.0)), HERE)

    assert found is not None
    assert found.depth_mm == pytest.approx(3.0)  # its far side at y = 2, the face at 5
    assert found.normal == pytest.approx([0.0, 1.0, 0.0])


def test_a_prisms_faces_are_measured_one_by_one() -> None:
    palm = Halfspaces(prism_vertices(30.0, -50.0, 0.0, sides=16))

    found = penetration(palm, placed((50.0, 10.0, 20.0), (26.0, -5.0, -30.0)), HERE)

    assert len(palm.normals) == 18
    assert found is not None
    assert found.depth_mm == pytest.approx(_first_of_the_ring(palm.normals))


def _first_of_the_ring(normals: FloatArray) -> float:
    """The block's inner edge lies at x = 26, |y| ≤ 5: least over the faces of 30 − min n·p."""
    corners = np.array([[26.0, -5.0], [26.0, 5.0]])
    ring = normals[np.abs(normals[:, 2]) < 0.5][:, :2]
    return float((30.0 - (corners @ ring.T).min(axis=0)).min())


def test_the_depth_moves_with_both() -> None:
    X = pose(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), np.array([3.0, -7.0, 11.0]))
    block = placed((100.0, 100.0, 100.0), (6.2, -20.0, -60.0))

    found = penetration(Halfspaces(SOLID), Triangles(moved(block.mesh, X)), inverse(X))

    assert found is not None
    assert found.depth_mm == pytest.approx(1.8)
