"""Shrinking solids against meshes: as bisection with FCL finds, and as closed forms say."""

import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.collision import ConvexShape, MeshSurface, PlacedSurface, Scene
from gripwright.geometry.polytope import Faces, Polytope
from gripwright.geometry.solids import box_vertices, prism_vertices, swept
from gripwright.geometry.triangle_blocks import TriangleBlocks
from gripwright.geometry.withdrawal import Shrinking, shortened, standing, withdrawn
from mesh_factory import box_mesh, moved

BACK = np.array([0.0, 0.0, -1.0])
LONGEST = 100.0


def last_touch_mm(mesh: Mesh, solid: Shrinking, X_SM: FloatArray | None = None) -> float:
    """Of a solid that stands at the origin, within [0, LONGEST]."""
    return TriangleBlocks(mesh).last_touch_mm(solid, standing(np.eye(4)), np.eye(4) if X_SM is None else X_SM, 0.0, LONGEST)


def volume(faces: Faces) -> float:
    """Of the solid, by the corners of its half-spaces' common part."""
    planes = np.column_stack([faces.normals, -faces.offsets])
    corners = HalfspaceIntersection(planes, (faces.low + faces.high) / 2.0).intersections
    return float(ConvexHull(corners).volume)


@pytest.mark.parametrize("displacement", [(3.0, 0.0, 0.0), (0.0, 0.0, -7.0), (4.0, -5.0, 2.5), (0.1, 30.0, -0.01)])
@pytest.mark.parametrize("points", [box_vertices(-np.ones(3), np.array([2.0, 3.0, 1.0])), prism_vertices(5.0, -4.0, 0.0)])
def test_a_polytope_sweeps_what_the_hull_of_its_start_and_end_holds(points: FloatArray, displacement: FloatArray) -> None:
    faces = Polytope(points).swept(np.array(displacement))

    hull = ConvexHull(swept(points, np.array(displacement)))

    assert volume(faces) == pytest.approx(hull.volume, rel=1e-9)
    assert (points @ faces.normals.T <= faces.offsets + 1e-9).all()
    assert ((points + displacement) @ faces.normals.T <= faces.offsets + 1e-9).all()


@pytest.mark.parametrize("height", [2.0, 31.5, 99.0])
def test_a_palm_moves_back_to_the_highest_point_before_it(height: float) -> None:
    post = moved(box_mesh((4.0, 4.0, 200.0)), _at((8.0, 0.0, -height)))
    palm = withdrawn(Polytope(prism_vertices(10.0, -50.0, 0.0)).faces, BACK, LONGEST)

    assert last_touch_mm(post, palm) == pytest.approx(height, abs=1e-9)


def test_what_is_not_touched_at_the_start_is_never_touched() -> None:
    palm = withdrawn(Polytope(prism_vertices(10.0, -50.0, 0.0)).faces, BACK, LONGEST)
    aside, before = (moved(box_mesh((4.0, 4.0, 4.0)), _at(place)) for place in ((30.0, 0.0, -10.0), (0.0, 0.0, 5.0)))

    assert last_touch_mm(aside, palm) == -np.inf
    assert last_touch_mm(before, palm) == -np.inf


def test_what_is_touched_throughout_is_touched_at_the_end() -> None:
    palm = withdrawn(Polytope(prism_vertices(10.0, -50.0, 0.0)).faces, BACK, LONGEST)
    tall = moved(box_mesh((4.0, 4.0, 300.0)), _at((0.0, 0.0, -290.0)))

    assert last_touch_mm(tall, palm) == LONGEST


def test_a_stem_is_shortened_to_the_ledge_behind_its_tip() -> None:
    ledge = moved(box_mesh((40.0, 40.0, 5.0)), _at((2.0, -20.0, -45.0)))
    stem = shortened(Polytope(box_vertices(np.array([0.0, -5.0, -LONGEST]), np.array([8.0, 5.0, 0.0]))).faces, BACK)

    assert last_touch_mm(ledge, stem) == pytest.approx(LONGEST - 40.0, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    displacement=st.tuples(*[st.floats(-40.0, 40.0)] * 3),
    faces=st.sampled_from([20, 320, 5120]),
)
@example(seed=1, displacement=(0.0, 8.6e-163, 0.0), faces=20)
def test_it_finds_what_bisection_with_fcl_finds(seed: int, displacement: tuple[float, float, float], faces: int) -> None:
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions={20: 0, 320: 2, 5120: 4}[faces], radius=20.0)
    mesh = Mesh(vertices_mm=np.asarray(ball.vertices * rng.uniform(0.3, 1.0, 3)), faces=np.asarray(ball.faces))
    X = np.eye(4)
    X[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    X[:3, 3] = rng.uniform(-30.0, 30.0, 3)
    palm = Polytope(prism_vertices(12.0, -60.0, 0.0))
    points = swept(palm.vertices, np.array(displacement))

    found = last_touch_mm(mesh, withdrawn(palm.swept(np.array(displacement)), BACK, LONGEST), X)

    scene = Scene([PlacedSurface(name="ball", surface=MeshSurface(mesh), X=X)])
    longer = swept(points, BACK * LONGEST)  # withdrawn, its back stays where it ends up
    assert found == pytest.approx(_bisected(scene, longer), abs=0.01)


def _bisected(scene: Scene, points: FloatArray) -> float:
    def touches(s: float) -> bool:
        place = _at((0.0, 0.0, -s))
        return bool(scene.first_hits(ConvexShape(points), place[None])[0] >= 0)

    if not touches(0.0):
        return -np.inf
    low, high = 0.0, LONGEST
    if touches(high):
        return LONGEST
    while high - low > 0.002:
        middle = (low + high) / 2.0
        low, high = (middle, high) if touches(middle) else (low, middle)
    return (low + high) / 2.0


def _at(place: tuple[float, float, float]) -> FloatArray:
    X = np.eye(4)
    X[:3, 3] = place
    return X
