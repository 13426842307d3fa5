"""A block held by two fingers: what stands in the way is found, and finger lengths are what the geometry says."""

import numpy as np
import pytest

from gripwright.design.contact import contacts, seat
from gripwright.design.finger_lengths import length_max, length_min
from gripwright.design.hand_check import HandCheck, OperationScene
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, Grasp
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.collision import MeshSurface, PlacedSurface, Scene
from gripwright.geometry.frames import pose
from gripwright.geometry.held_surface import Surface
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from mesh_factory import box_mesh, moved

HAND = ParallelHand(HandSettings())
MARGIN = 0.1
DOWN = np.array([0.0, 0.0, -1.0])
X_AXIS = np.array([1.0, 0.0, 0.0])


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    X = np.eye(4)
    X[:3, 3] = low
    return moved(box_mesh((high[0] - low[0], high[1] - low[1], high[2] - low[2])), X)


HELD = block((-10.0, -10.0, 0.0), (10.0, 10.0, 20.0))


def grasp(depth: float = 5.0, width: float = 20.0, across: float = 0.0) -> Grasp:
    """From above, the tips `depth` below the block's top."""
    X = pose(X_AXIS, np.cross(DOWN, X_AXIS), DOWN, np.array([0.0, across, 20.0 - depth]))
    return Grasp(X_CG=X, gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=width)


def scene(*standing: Mesh, motion: FloatArray | None = None, release: float = 1.0) -> OperationScene:
    way = np.stack([np.eye(4), np.eye(4)]) if motion is None else motion
    if motion is None:
        way[0, 2, 3] = 100.0
    return OperationScene(
        attached=Scene([PlacedSurface(name="held", surface=MeshSurface(HELD), X=np.eye(4))]),
        standing=Scene(
            [PlacedSurface(name=f"block {i}", surface=MeshSurface(mesh), X=np.eye(4)) for i, mesh in enumerate(standing)]
        ),
        X_PC=np.eye(4),
        motion=way,
        margin_mm=MARGIN,
        release_clearance_mm=release,
    )


def test_a_seated_grasp_just_touches_and_enters_nothing() -> None:
    seated = seat(grasp(width=20.2), Surface(HELD), HAND)

    assert isinstance(seated, Grasp)
    assert seated.opening_width_mm == pytest.approx(20.0, abs=0.01)
    assert seated.opening_width_mm > 20.0
    assert HandCheck(scene(), HAND).seated(seated, 40.0) is None


def test_fingers_that_are_off_centre_are_centred() -> None:
    seated = seat(grasp(), Surface(moved(HELD, pose(X_AXIS, np.array([0, 1.0, 0]), -DOWN, np.array([0.3, 0, 0])))), HAND)

    assert isinstance(seated, Grasp)
    assert seated.X_CG[0, 3] == pytest.approx(0.3, abs=1e-9)


def test_the_contact_is_as_high_and_as_large_as_what_the_finger_covers() -> None:
    found = contacts(grasp(depth=6.0, width=20.001), Surface(HELD), HAND, 30.0, 3.0)

    assert not isinstance(found, Rejection)
    assert [contact.height_mm for contact in found] == pytest.approx([6.0, 6.0])
    assert [contact.area_mm2 for contact in found] == pytest.approx([60.0, 60.0])
    assert found[0].centre_C == pytest.approx([10.0, 0.0, 17.0], abs=0.01)


def test_a_contact_lower_than_the_least_is_refused_with_both_figures() -> None:
    found = contacts(grasp(depth=2.0, width=20.001), Surface(HELD), HAND, 30.0, 3.0)

    assert isinstance(found, Rejection)
    assert "2.00 mm" in found.detail
    assert "3.00 mm" in found.detail


@pytest.mark.parametrize(("gap", "free"), [(0.09, False), (0.12, True)])
def test_a_wall_beside_the_opened_finger_has_to_keep_the_margin(gap: float, free: bool) -> None:
    outside = 10.0 + 8.0 + 0.5 + gap  # half the width, the finger, half the release
    wall = block((outside, -30.0, -5.0), (outside + 5.0, 30.0, 25.0))

    assert (HandCheck(scene(wall), HAND).seated(grasp(width=20.001), 40.0) is None) is free


def test_an_obstacle_that_only_the_way_crosses_is_found_however_thin_it_is() -> None:
    sheet = block((12.0, -3.0, 60.0), (14.0, 3.0, 60.02))

    miss = HandCheck(scene(sheet), HAND).rough(grasp(), 3.0)

    assert miss is not None
    assert "block 0" in miss.detail


def test_a_hollow_obstacle_around_the_hand_is_found_on_the_way_out() -> None:
    lid = block((-60.0, -60.0, 90.0), (60.0, 60.0, 95.0))

    miss = HandCheck(scene(lid, motion=np.stack([np.eye(4), np.eye(4)])), HAND).rough(grasp(), 3.0)

    assert miss is not None
    assert miss.code == "collision"


@pytest.mark.parametrize("height", [7.0, 31.5])
def test_the_least_finger_length_clears_what_stands_beside_the_component(height: float) -> None:
    post = block((-5.0, 18.0, 0.0), (5.0, 25.0, 20.0 + height))  # beside the fingers, below the palm of radius 40

    lengths, miss = length_min(HandCheck(scene(post), HAND), grasp(depth=5.0), np.array([10.0, 40.0]), 3.0)

    assert miss is None
    assert lengths[0] == pytest.approx(5.0 + MARGIN, abs=0.01)  # a palm of radius 10 has only the held block before it
    assert lengths[1] == pytest.approx(5.0 + height + MARGIN, abs=0.01)


def test_a_roof_over_the_stems_bounds_the_finger_length_from_above() -> None:
    ledge = block((18.2, -30.0, 40.0), (40.0, 30.0, 45.0))  # 0.2 beside the closed fingers: open, they are past its edge
    still = np.stack([np.eye(4), np.eye(4)])

    check = HandCheck(scene(ledge, motion=still, release=0.0), HAND)

    assert length_max(check, grasp(depth=5.0), 6.0) == (float("inf"), None)
    near = HandCheck(scene(block((18.05, -30.0, 40.0), (40.0, 30.0, 45.0)), motion=still, release=0.0), HAND)
    assert near.rough(grasp(depth=5.0), 3.0) is not None


def test_the_answer_moves_with_the_scene() -> None:
    turn = pose(np.array([0.0, 1.0, 0.0]), np.array([-1.0, 0.0, 0.0]), -DOWN, np.array([30.0, -7.0, 5.0]))
    post = block((-5.0, 18.0, 0.0), (5.0, 25.0, 40.0))
    here = scene(post)
    there = OperationScene(
        attached=here.attached,
        standing=Scene([PlacedSurface(name="block 0", surface=MeshSurface(post), X=turn)]),
        X_PC=turn,
        motion=here.motion,
        margin_mm=MARGIN,
        release_clearance_mm=1.0,
    )

    one = length_min(HandCheck(here, HAND), grasp(), np.array([40.0]), 3.0)[0]
    other = length_min(HandCheck(there, HAND), grasp(), np.array([40.0]), 3.0)[0]

    assert one == pytest.approx(other, abs=0.01)


def test_grasps_checked_together_miss_as_each_by_itself() -> None:
    walls = scene(block((18.0, -3.0, 30.0), (25.0, 3.0, 45.0)), block((-40.0, 8.0, 0.0), (40.0, 14.0, 60.0)))
    grasps = [
        grasp(depth=depth, width=width, across=across)
        for depth in (-2.0, 3.0, 12.0)
        for width in (12.0, 19.0, 20.2, 30.0)
        for across in (-9.0, 0.0, 4.0)
    ]

    together = list(HandCheck(walls, HAND).roughs(grasps, 3.0))

    assert together == [HandCheck(walls, HAND).rough(one, 3.0) for one in grasps]
    assert {None if miss is None else miss.stage for miss in together} >= {None, 0, 2}


@pytest.mark.parametrize("bottom", [45.0, 61.3, 120.0])
def test_a_beam_over_the_way_bounds_the_finger_length_from_above(bottom: float) -> None:
    """Pushed in from the side, under a beam: stems reach no higher than the margin below it."""
    way = np.stack([np.eye(4), np.eye(4)])
    way[0, 1, 3] = -100.0
    beam = block((-40.0, -55.0, bottom), (40.0, -50.0, bottom + 5.0))  # ends before the palm's place at either end

    longest, miss = length_max(HandCheck(scene(beam, motion=way), HAND), grasp(depth=5.0), 6.0)

    assert miss is None
    assert longest == pytest.approx(bottom - 15.0 - MARGIN, abs=0.01)


def test_stems_that_pass_too_low_at_any_length_are_a_miss() -> None:
    way = np.stack([np.eye(4), np.eye(4)])
    way[0, 1, 3] = -100.0
    beam = block((-40.0, -55.0, 18.0), (40.0, -50.0, 23.0))

    length, miss = length_max(HandCheck(scene(beam, motion=way), HAND), grasp(depth=5.0), 6.0)

    assert length == 6.0
    assert miss is not None
    assert miss.detail.startswith("finger 1 hits block 0")
