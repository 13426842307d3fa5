import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gripwright.geometry.collision import ConvexShape, MeshSurface, PlacedSurface, Scene
from gripwright.geometry.polytope import Polytope
from gripwright.geometry.rooms import rooms
from gripwright.geometry.withdrawal import standing, withdrawn
from mesh_factory import box_mesh


@settings(deadline=None)  # the first call compiles
@given(st.integers(0, 10**6))
def test_a_body_in_its_room_is_missed_by_every_box(seed):
    rng = np.random.default_rng(seed)
    centre, half = rng.integers(-9, 10, (40, 3)) + 0.0, rng.integers(0, 4, (40, 3)) / 2.0
    low = rng.integers(-6, 6, (5, 3)) + 0.0
    high = low + rng.integers(0, 3, (5, 3))

    found = rooms(centre - half, centre + half, low, high)

    near = ((low[:, None] <= centre + half) & (high[:, None] >= centre - half)).all(axis=2).any(axis=1)
    assert (found.hold(low, high) == ~near).all()
    moved_low = low + rng.integers(-3, 4, low.shape) / 2.0
    moved_high = moved_low + rng.integers(0, 8, low.shape) / 2.0
    held = found.hold(moved_low, moved_high)
    missed = ~((moved_low[:, None] <= centre + half) & (moved_high[:, None] >= centre - half)).all(axis=2).any(axis=1)
    assert missed[held].all()


def test_what_no_box_was_asked_about_has_all_the_room():
    found = rooms(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((1, 3)), np.ones((1, 3)))

    assert found.hold(np.full((1, 3), -1e6), np.full((1, 3), 1e6)).all()


def _scene(*places):
    surface = MeshSurface(box_mesh((1.0, 1.0, 1.0)))
    return Scene([PlacedSurface(name=str(k), surface=surface, X=_at(*place)) for k, place in enumerate(places)])


def _at(x, y, z):
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
ASKED = {
    "first_hits": lambda scene: scene.first_hits(ConvexShape(CUBE), np.array([_at(4.0, 0.0, 0.0)])),
    "last_touch": lambda scene: scene.last_touch(
        withdrawn(Polytope(CUBE).faces, np.array([0.0, 0.0, -1.0]), 1.0), standing(_at(4.0, 0.0, 0.0)), 0.0, 1.0
    ),
    "touched": lambda scene: scene.touched(ConvexShape(CUBE), _at(4.0, 0.0, 0.0)),
    "distance": lambda scene: scene.distance(ConvexShape(CUBE), _at(4.0, 0.0, 0.0), 0.5),
    "first_surface_hit": lambda scene: scene.first_surface_hit(MeshSurface(box_mesh((1.0, 1.0, 1.0))), _at(4.0, 0.0, 0.0)),
    "surface_distance": lambda scene: scene.surface_distance(MeshSurface(box_mesh((1.0, 1.0, 1.0))), _at(4.0, 0.0, 0.0), 0.5),
    "inside": lambda scene: scene.inside(np.array([4.5, 0.5, 0.5])),
    "holds": lambda scene: scene.holds(np.array([[4.5, 0.5, 0.5]])),
}


def test_a_scene_tells_the_rooms_that_each_of_its_questions_leaves():
    for question, ask in ASKED.items():
        scene = _scene((0.0, 0.0, 0.0), (4.0, 0.5, 0.0))
        with scene.watched() as watch:
            ask(scene)
        found = watch.rooms()

        assert found.hold(scene.low, scene.high).tolist() == [True, False], question
        assert not found.hold(scene.low, scene.high + np.array([3.6, 0.0, 0.0]))[0], question
        assert found.hold(scene.low - 50.0, scene.high + np.array([2.4, 50.0, 50.0]))[0], question


def test_no_question_of_a_scene_goes_unwatched():
    questions = {name for name, member in vars(Scene).items() if callable(member) and not name.startswith("_")}

    assert questions - {"watched"} == set(ASKED)


def test_what_a_scene_is_asked_besides_is_not_watched():
    scene = _scene((0.0, 0.0, 0.0))
    with scene.watched() as watch:
        pass
    scene.inside(np.zeros(3))

    assert watch.rooms().hold(scene.low, scene.high).all()


def test_a_distance_without_limit_asks_of_what_is_no_farther_than_the_answer():
    scene = _scene((0.0, 0.0, 0.0), (9.0, 0.0, 0.0))
    with scene.watched() as watch:
        found = scene.surface_distance(MeshSurface(box_mesh((1.0, 1.0, 1.0))), _at(7.0, 0.0, 0.0), np.inf)

    assert found == 1.0
    assert watch.rooms().hold(scene.low, scene.high).tolist() == [True, False]
