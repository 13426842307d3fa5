"""Sweeps leave no gap, whatever the motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from finer import finer_motions
from gripwright.design.motion import sampled, stretches
from gripwright.design.sweeps import Sweeps
from gripwright.domain.shape import FloatArray
from gripwright.geometry.collision import MeshSurface, PlacedSurface, Scene
from gripwright.geometry.frames import is_rigid
from gripwright.geometry.polytope import Polytope
from gripwright.geometry.solids import box_vertices
from gripwright.geometry.withdrawal import withdrawn
from mesh_factory import box_mesh

FINGER = box_vertices(np.array([0.0, -5.0, -30.0]), np.array([8.0, 5.0, 0.0]))


def pose(angle_deg: float = 0.0, z: float = 0.0, x: float = 0.0) -> FloatArray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()
    X[:3, 3] = x, 0.0, z
    return X


def screw(turns: float, pitch: float, steps_a_turn: int = 8) -> FloatArray:
    count = round(turns * steps_a_turn)
    return np.array([pose(-360.0 * i / steps_a_turn, -pitch * i / steps_a_turn) for i in range(count + 1)])


def speck(point: FloatArray) -> Scene:
    X = np.eye(4)
    X[:3, 3] = point
    return Scene([PlacedSurface(name="speck", surface=MeshSurface(box_mesh((0.01, 0.01, 0.01))), X=X)])


def hits(sweeps: Sweeps, scene: Scene, margin_mm: float, X_PB: FloatArray) -> bool:
    """Whether the finger comes nearer than the margin to what stands in the scene."""
    return bool(sweeps.first_hits(scene, FINGER, margin_mm, X_PB[None])[0] >= 0)


MOTIONS = {
    "straight": np.array([pose(z=100.0), pose()]),
    "slanted, with a corner": np.array([pose(z=80.0, x=-40.0), pose(z=20.0), pose()]),
    "a quarter turn": np.array([pose(90.0), pose()]),
    "a screw of three turns": screw(3.0, 2.0),
    "down, then eleven turns": np.concatenate([[pose(z=90.0)], screw(11.0, 2.0)]),
}


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_a_sweep_holds_the_solid_at_every_moment(motion: FloatArray) -> None:
    rng = np.random.default_rng(11)
    hand = pose(25.0, 3.0, 12.0)
    low, high = FINGER.min(axis=0), FINGER.max(axis=0)
    sweeps = Sweeps(motion)

    for place in sampled(motion, 60):
        inside = rng.uniform(low, high)
        point = (place @ hand @ np.append(inside, 1.0))[:3]
        assert hits(sweeps, speck(point), 0.0, hand)


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_a_sweep_reaches_hardly_farther_than_the_solid(motion: FloatArray) -> None:
    rng = np.random.default_rng(7)
    hand = pose(25.0, 3.0, 12.0)
    sweeps = Sweeps(motion)
    low, high = FINGER.min(axis=0), FINGER.max(axis=0)
    moments = np.array(sampled(motion, 400)) @ hand
    seen_from = np.linalg.inv(moments)
    apart = 0

    for moment in [*moments[::10], *moments[-1:].repeat(20, axis=0)]:
        beside = moment @ [*rng.uniform(low - 4.0, high + 4.0), 1.0]
        local = (seen_from @ beside)[:, :3]
        clear = np.linalg.norm(np.maximum(np.maximum(low - local, local - high), 0.0), axis=1).min()
        if clear > 0.5:  # nowhere along the motion nearer than that
            apart += 1
            assert not hits(sweeps, speck(beside[:3]), 0.0, hand)
    assert apart > 5


@pytest.mark.parametrize("turns", [1.0, 1.25, 2.0, 2.625, 3.0, 11.0])
@pytest.mark.parametrize("steps_a_turn", [5, 8])
def test_a_screw_is_swept_down_to_its_end_and_no_farther(turns: float, steps_a_turn: int) -> None:
    """A pitch of 2: one turn more would lead 2 mm deeper."""
    motion = screw(turns, 2.0, steps_a_turn)
    hand = pose(z=30.0, x=12.0)
    sweeps = Sweeps(motion)

    for turned in np.linspace(0.0, 360.0, 8, endpoint=False):  # on the way about the axis, before the end
        rise = 2.0 * turned / 360.0
        lowest = (motion[-1] @ pose(turned, rise) @ hand @ [4.0, 0.0, -30.0, 1.0])[:3]
        assert hits(sweeps, speck(lowest + np.array([0.0, 0.0, 0.05])), 0.0, hand)
    under = (motion[-1] @ hand @ [4.0, 0.0, -30.0, 1.0])[:3]
    assert not hits(sweeps, speck(under - np.array([0.0, 0.0, 0.3])), 0.0, hand)


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_what_is_free_stays_free_with_arcs_a_tenth_as_long(motion: FloatArray) -> None:
    rng = np.random.default_rng(13)
    hand = pose(25.0, 3.0, 12.0)
    low, high = FINGER.min(axis=0) - 2.0, FINGER.max(axis=0) + 2.0
    specks = [speck((place @ hand @ [*rng.uniform(low, high), 1.0])[:3]) for place in sampled(motion, 120)]
    coarse = [hits(Sweeps(motion), one, 0.1, hand) for one in specks]

    with finer_motions():
        sweeps = Sweeps(motion)
        fine = [hits(sweeps, one, 0.1, hand) for one in specks]

    assert 0 < coarse.count(False) < len(specks)
    assert not any(after for before, after in zip(coarse, fine, strict=True) if not before)


def test_neighbouring_straight_legs_are_one_stretch_and_turns_of_a_thread_another() -> None:
    ways = stretches(np.concatenate([[pose(z=90.0), pose(z=50.0)], screw(11.0, 2.0)]))

    assert [len(way.poses) for way in ways] == [2, 41]
    assert ways[1].drift_P == pytest.approx(np.tile([0.0, 0.0, -2.0 * 10], (40, 1)), abs=1e-6)  # from the first turn to the last


def test_sampled_poses_are_rigid_and_begin_and_end_with_the_motion() -> None:
    motion = MOTIONS["down, then eleven turns"]

    poses = sampled(motion, 50)

    assert all(is_rigid(place) for place in poses)
    assert poses[0] == pytest.approx(motion[0])
    assert poses[-1] == pytest.approx(motion[-1])


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_many_solids_are_swept_as_each_by_itself(motion: FloatArray) -> None:
    stands = Scene(
        [
            PlacedSurface(name=name, surface=MeshSurface(box_mesh((6.0, 6.0, 6.0))), X=pose(x=x, z=z))
            for name, x, z in (("low", 12.0, -20.0), ("high", -30.0, 40.0))
        ]
    )
    rng = np.random.default_rng(2)
    poses = np.array([pose(rng.choice([0.0, 30.0, 200.0]), z=rng.uniform(-25, 25), x=rng.uniform(-25, 25)) for _ in range(60)])

    together = Sweeps(motion).first_hits(stands, FINGER, 0.1, poses).tolist()

    assert together == [int(Sweeps(motion).first_hits(stands, FINGER, 0.1, X[None])[0]) for X in poses]
    assert -1 in together
    assert len(set(together)) > 1


@pytest.mark.parametrize("tilt_deg", [0.0, 35.0, 90.0])
@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_a_solid_that_shrinks_leaves_a_motion_where_its_places_do(motion: FloatArray, tilt_deg: float) -> None:
    X_PB = pose(25.0, 3.0, 12.0)
    X_PB[:3, :3] = X_PB[:3, :3] @ Rotation.from_euler("y", tilt_deg, degrees=True).as_matrix()
    point = X_PB[:3, :3] @ [4.0, 2.0, -60.0] + X_PB[:3, 3]
    palm, back = Polytope(box_vertices(np.array([-20.0, -9.0, -300.0]), np.array([15.0, 9.0, 0.0]))), np.array([0.0, 0.0, -1.0])

    found, _ = Sweeps(motion).last_touch(speck(point), palm, X_PB, lambda faces: withdrawn(faces, back, 100.0), (0.0, 100.0))

    places = np.array([place @ X_PB for place in sampled(motion, 20000)])
    seen = np.einsum("nji,nj->ni", places[:, :3, :3], point - places[:, :3, 3])  # from the solid
    within = (seen[:, 0] >= -20.0) & (seen[:, 0] <= 15.0) & (np.abs(seen[:, 1]) <= 9.0) & (seen[:, 2] >= -400.0)
    least = min(float(np.max(-seen[within, 2], initial=-np.inf)), 100.0)
    more = 0.2 if len(motion) > 40 else 0.0  # what lies between many turns is swept too
    assert least - 0.03 <= found <= least + 0.03 + more  # the speck's size and the sampling
