"""Between planned grasps: ranges are divided without gap or overlap, and none is left out in which a grasp is free."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gripwright.design.hand_check import HandCheck
from gripwright.design.places import Places, hopeless
from gripwright.design.scenes import Body, operation_scene
from gripwright.domain.assembly import Component, Obstacle, Operation
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, INTERNAL, PARALLEL_2, Grasp
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import moved
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from mesh_factory import box_mesh

TIPS_MM = 3.0
ABOUT_X = np.array([[-0.13, 0.13], [0.0, 0.0], [-2.5, 2.5], [0.0, 8.0]])
ABOUT_Z = np.array([[0.0, 0.0], [-0.13, 0.13], [0.0, 0.0], [0.0, 8.0]])


def turned_pose(seed: int) -> FloatArray:
    X = np.eye(4)
    X[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    X[:3, 3] = np.random.default_rng(seed).uniform(-20.0, 20.0, 3)
    return X


def grasp_of(X: FloatArray, leeway: FloatArray | None, kind: str = PARALLEL_2, grip: str = EXTERNAL) -> Grasp:
    return Grasp(X_CG=X, gripper_type=kind, grip=grip, opening_width_mm=24.0, leeway=leeway)


def test_halved_ranges_fill_the_whole_without_overlap_and_are_small_enough() -> None:
    size = np.array([0.05, 0.05, 1.0, 1.5])
    whole = Places.of([grasp_of(turned_pose(1), ABOUT_X), grasp_of(np.eye(4), None), grasp_of(turned_pose(2), ABOUT_Z)])

    parts = whole.halved(size)

    assert (parts.extents <= size).all()
    assert len(parts) == 8 * 8 * 8 + 8 * 8
    for parent in range(2):
        own = parts.parent == parent
        used = whole.extents[parent] > 0.0
        assert parts.extents[own][:, used].prod(axis=1).sum() == pytest.approx(whole.extents[parent][used].prod())
        apart = np.abs(parts.low[own][:, None] - parts.low[own][None]).max(axis=2)
        assert (apart + np.eye(own.sum()) > 1e-6).all()  # equal parts that begin at different places do not overlap
    assert (np.diff(parts.parent) >= 0).all()


def test_a_middle_is_the_parent_turned_about_its_own_tips_and_shifted_along_its_own_axes() -> None:
    X = turned_pose(3)
    leeway = np.array([[0.0, 0.4], [0.0, 0.0], [2.0, 4.0], [0.0, 10.0]]) * [[1.0, 1.0]]
    (middle,) = Places.of([grasp_of(X, leeway)]).middles()

    assert middle.X_CG[:3, 3] == pytest.approx(X[:3, 3] + 3.0 * X[:3, 1] + 5.0 * X[:3, 2])
    assert middle.X_CG[:3, 0] == pytest.approx(X[:3, 0])
    assert middle.X_CG[:3, 2] == pytest.approx(np.cos(0.2) * X[:3, 2] - np.sin(0.2) * X[:3, 1])


@pytest.mark.parametrize(
    ("kind", "grip", "leeway"),
    [(PARALLEL_2, EXTERNAL, ABOUT_X), (CENTRIC_3, EXTERNAL, ABOUT_Z), (CENTRIC_3, INTERNAL, ABOUT_Z)],
)
def test_where_a_range_is_left_out_every_grasp_in_it_collides(kind: str, grip: str, leeway: FloatArray) -> None:
    rng = np.random.default_rng(5)
    hand = ParallelHand(HandSettings()) if kind == PARALLEL_2 else CentricHand(CentricSettings())
    left_out, kept = 0, 0
    for seed in range(40):
        X = np.eye(4)
        X[:3, 3] = rng.uniform(-40.0, 40.0, 3)
        obstacle = Obstacle(id="block", mesh=box_mesh((12.0, 9.0, 15.0)), X_PE=X @ turned_pose(seed))
        grain = Body(component=Component(id="c", mesh=box_mesh((0.1, 0.1, 0.1)), X_PC=np.eye(4)), solid=box_mesh((0.1, 0.1, 0.1)))
        way = np.stack([np.eye(4), np.eye(4)])
        way[0, :3, 3] = rng.uniform(-30.0, 30.0, 3)
        operation = Operation(id="op", active=("c",), passive=(), motion=way)
        scene = operation_scene(operation, grain, [], [], [obstacle], 0.1, 1.0)
        down = np.diag([1.0, -1.0, -1.0, 1.0])
        places = Places.of([grasp_of(down, leeway, kind, grip)]).halved(np.array([0.08, 0.08, 1.3, 2.0]))
        blocked = hopeless(places, places.middles(), hand, scene, TIPS_MM)
        left_out, kept = left_out + int(blocked.sum()), kept + int((~blocked).sum())
        for i in rng.choice(np.flatnonzero(blocked), min(3, int(blocked.sum())), replace=False):
            at = rng.uniform(places.low[i], places.high[i], (20, 4))
            at[:16] = np.where(rng.random((16, 4)) < 0.5, places.low[i], places.high[i])  # corners
            inside = [grasp_of(down @ X_there, None, kind, grip) for X_there in moved(at)]
            assert all(HandCheck(scene, hand).roughs(inside, TIPS_MM))

    assert left_out > 100
    assert kept > 100


def test_where_no_grasp_was_planned_there_is_none_in_between() -> None:
    places = Places.of([]).halved(np.full(4, 0.1))

    assert places.middles() == []
