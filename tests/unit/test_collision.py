"""Touching, overlapping, separated and contained, for convex and other obstacles."""

import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.collision import ConvexShape, MeshSurface, PlacedSurface, Scene, winding_number
from gripwright.geometry.solids import box_vertices, dilated, prism_vertices, swept
from mesh_factory import box_mesh, moved

CUBE = box_vertices(np.full(3, -1.0), np.full(3, 1.0))


def first_hit(scene: Scene, shape: ConvexShape, X: FloatArray) -> str | None:
    """Name of a mesh whose surface the solid touches at pose X, or None."""
    hit = int(scene.first_hits(shape, X[None])[0])
    return None if hit < 0 else scene.names[hit]


def block(side: float) -> Mesh:
    """A cube about the origin."""
    return moved(box_mesh((side, side, side)), at(-side / 2, -side / 2, -side / 2))


def at(x: float, y: float = 0.0, z: float = 0.0) -> FloatArray:
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def scene_of(mesh: Mesh, X: FloatArray | None = None) -> Scene:
    return Scene([PlacedSurface(name="it", surface=MeshSurface(mesh), X=np.eye(4) if X is None else X)])


def channel() -> Mesh:
    """A block of 20 with a slot of 6 × 6 along x from above: not convex."""
    solid = manifold3d.Manifold.cube((20, 20, 20), True) - manifold3d.Manifold.cube((30, 6, 12), True).translate((0, 0, 10))
    mesh = solid.to_mesh()
    return Mesh(vertices_mm=np.array(mesh.vert_properties[:, :3], dtype=float), faces=np.array(mesh.tri_verts, dtype=np.int64))


@pytest.mark.parametrize(("x", "hits"), [(5.9, True), (6.001, False), (20.0, False)])
def test_a_solid_beside_a_block_is_hit_only_where_it_reaches_it(x: float, hits: bool) -> None:
    scene = scene_of(block(10.0))

    assert (first_hit(scene, ConvexShape(CUBE), at(x)) == "it") is hits


def test_a_solid_in_the_slot_of_a_block_is_free_and_not_inside() -> None:
    scene = scene_of(channel())

    assert first_hit(scene, ConvexShape(CUBE), at(0, 0, 8)) is None
    assert scene.inside(np.array([0.0, 0.0, 8.0])) is None


def test_a_solid_wholly_inside_a_block_crosses_no_surface_but_lies_inside() -> None:
    scene = scene_of(block(10.0))

    assert first_hit(scene, ConvexShape(CUBE), at(0)) is None
    assert scene.inside(np.zeros(3)) == "it"


def test_a_block_wholly_inside_a_solid_is_hit() -> None:
    scene = scene_of(block(1.0))

    assert first_hit(scene, ConvexShape(4.0 * CUBE), at(0)) == "it"


def test_distance_is_measured_from_any_side_and_is_zero_where_surfaces_cross() -> None:
    scene = scene_of(block(10.0))

    assert scene.distance(ConvexShape(CUBE), at(9.0))[0] == pytest.approx(3.0, abs=1e-6)
    assert scene.distance(ConvexShape(prism_vertices(2.0, -1.0, 1.0)), at(0, 0, 8.5))[0] == pytest.approx(2.5, abs=1e-6)
    assert scene.distance(ConvexShape(CUBE), at(5.5)) == (0.0, "it")
    assert scene.distance(ConvexShape(CUBE), at(50.0), limit=10.0) == (10.0, None)


def test_answers_do_not_depend_on_where_the_scene_stands() -> None:
    rng = np.random.default_rng(5)
    for _ in range(5):
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3) * 300
        scene = scene_of(channel(), X)

        assert first_hit(scene, ConvexShape(CUBE), X @ at(0, 0, 8)) is None
        assert first_hit(scene, ConvexShape(CUBE), X @ at(0, 3, 8)) == "it"
        assert scene.distance(ConvexShape(CUBE), X @ at(0, 0, 8))[0] == pytest.approx(2.0, abs=1e-6)
        assert scene.inside(X[:3, 3] + X[:3, :3] @ np.array([0.0, 0.0, -5.0])) == "it"


def test_the_winding_number_tells_inside_from_outside_of_an_open_mesh_too() -> None:
    mesh = block(10.0)
    opened = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[1:])

    assert winding_number(mesh, np.zeros(3)) == pytest.approx(1.0)
    assert winding_number(mesh, np.array([20.0, 0.0, 0.0])) == pytest.approx(0.0, abs=1e-9)
    assert winding_number(opened, np.array([0.0, 0.0, 4.0])) > 0.5


def test_a_swept_box_holds_every_position_on_the_way() -> None:
    rng = np.random.default_rng(2)
    for displacement in (np.array([0.0, 0.0, 9.0]), np.array([0.0, -4.0, 0.0]), rng.normal(size=3) * 5):
        shape = swept(CUBE, displacement)
        scene = scene_of(block(0.02))
        for share in rng.random(20):
            point = displacement * share + rng.uniform(-1.0, 1.0, size=3)
            assert first_hit(scene, ConvexShape(shape), at(*-point)) == "it"


def test_a_dilated_solid_holds_all_points_within_the_margin() -> None:
    rng = np.random.default_rng(3)
    prism = prism_vertices(3.0, -2.0, 2.0)
    scene = scene_of(block(1e-3))
    grown = ConvexShape(dilated(prism, 0.5))
    for _ in range(100):
        direction = rng.normal(size=3)
        corner = prism[rng.integers(len(prism))] + 0.499 * direction / np.linalg.norm(direction)
        assert first_hit(scene, grown, at(*-corner)) == "it"


@pytest.mark.parametrize("solid", [CUBE, prism_vertices(1.0, -2.0, 1.0)], ids=["box", "prism"])
def test_many_poses_of_a_solid_are_answered_as_each_by_itself(solid: FloatArray) -> None:
    scene = Scene(
        [
            PlacedSurface(name=name, surface=MeshSurface(block(3.0)), X=at(x))
            for name, x in (("left", -3.0), ("right", 3.0), ("far", 90.0))
        ]
    )
    rng = np.random.default_rng(5)
    poses = np.tile(np.eye(4), (300, 1, 1))
    poses[:, :3, :3] = Rotation.random(300, random_state=5).as_matrix()
    poses[:, :3, 3] = rng.uniform(-7.0, 7.0, (300, 3))
    shape = ConvexShape(solid)

    together = [None if hit < 0 else scene.names[hit] for hit in scene.first_hits(shape, poses)]

    assert together == [first_hit(scene, shape, X) for X in poses]
    assert set(together) == {None, "left", "right"}


def test_nothing_is_hit_where_nothing_stands() -> None:
    assert Scene([]).first_hits(ConvexShape(CUBE), np.eye(4)[None]).tolist() == [-1]
