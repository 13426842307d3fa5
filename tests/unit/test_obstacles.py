"""Obstacles of every kind before a whole hand in a whole operation: contained, touching, thin and hollow, straight and screwed.

A block 20 wide is held from above across x, the tips 5 below its top, fingers 8 thick and 10 wide, a round palm behind them.
It is lowered, pushed in sideways, or screwed in by three turns. Places of obstacles follow from these figures alone.
"""

import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gripwright.design.finger_lengths import palm_hit
from gripwright.design.hand_check import HandCheck, OperationScene
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, Grasp
from gripwright.domain.shape import FloatArray
from gripwright.geometry.collision import MeshSurface, PlacedSurface, Scene
from gripwright.geometry.frames import pose
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from mesh_factory import mesh_of

Solid = manifold3d.Manifold
HAND = ParallelHand(HandSettings(thickness_mm=8.0, width_mm=10.0))
MARGIN_MM, RELEASE_MM, LENGTH_MM, PALM_RADIUS_MM = 0.1, 1.0, 60.0, 25.0
OUTSIDE_MM, HALF_WIDTH_MM = 10.0 + 8.0, 5.0  # of the closed fingers: outer faces in x, sides in y
TIPS_MM, PALM_MM = 15.0, 15.0 + LENGTH_MM  # levels at the seat
TURNED_MM = float(np.hypot(OUTSIDE_MM, HALF_WIDTH_MM))  # radius of what the closed fingers turn through
OPEN_MM = float(np.hypot(OUTSIDE_MM + RELEASE_MM / 2.0 + MARGIN_MM, HALF_WIDTH_MM + MARGIN_MM))
PITCH_MM, TURNS = 2.0, 3
ARC_MM = 0.1  # by so much more room a turning finger may be asked for, than it takes: arcs are swept by their chords


def displaced(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn_deg: float = 0.0) -> FloatArray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    X[:3, 3] = x, y, z
    return X


LOWERED = np.array([displaced(z=100.0), displaced()])
PUSHED_IN = np.array([displaced(y=100.0), displaced()])
SCREWED_IN = np.array([displaced(z=PITCH_MM * k / 8.0, turn_deg=45.0 * k) for k in range(8 * TURNS, -1, -1)])
MOTIONS = {"lowered": LOWERED, "pushed in": PUSHED_IN, "screwed in": SCREWED_IN}
every_motion = pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Solid:
    return Solid.cube([high[k] - low[k] for k in range(3)]).translate(low)


def about(point: tuple[float, float, float], side_mm: float) -> Solid:
    """A small cube about a point."""
    return Solid.cube([side_mm] * 3, True).translate(point)


def ring(bore_radius_mm: float, low_mm: float, high_mm: float, outer_radius_mm: float = 60.0) -> Solid:
    """Around the z axis; its bore is a polygon whose sides touch the radius from outside."""
    sides = 360
    bore = Solid.cylinder(high_mm - low_mm + 2.0, bore_radius_mm / np.cos(np.pi / sides), -1.0, sides).translate((0, 0, -1.0))
    return (Solid.cylinder(high_mm - low_mm, outer_radius_mm, -1.0, sides) - bore).translate((0, 0, low_mm))


def hit(motion: FloatArray, *standing: Solid, release_mm: float = RELEASE_MM) -> str | None:
    """What the check says against the hand with fingers of `LENGTH_MM`, or None: it is free."""
    held = PlacedSurface(name="held", surface=MeshSurface(mesh_of(box((-10.0, -10.0, 0.0), (10.0, 10.0, 20.0)))), X=np.eye(4))
    scene = OperationScene(
        attached=Scene([held]),
        standing=Scene([PlacedSurface(name="obstacle", surface=MeshSurface(mesh_of(one)), X=np.eye(4)) for one in standing]),
        X_PC=np.eye(4),
        motion=motion,
        margin_mm=MARGIN_MM,
        release_clearance_mm=release_mm,
    )
    down, x = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
    X_CG = pose(x, np.cross(down, x), down, np.array([0.0, 0.0, TIPS_MM]))
    grasp = Grasp(X_CG=X_CG, gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=20.001)
    check = HandCheck(scene, HAND)
    stems = check.seated(grasp, LENGTH_MM)
    return palm_hit(check, grasp, PALM_RADIUS_MM, LENGTH_MM) if stems is None else stems.detail


# --- contained ---------------------------------------------------------------------------------------------------------


@every_motion
def test_nothing_around_leaves_the_hand_free(motion: FloatArray) -> None:
    assert hit(motion) is None
    assert hit(motion, about((300.0, 0.0, 0.0), 20.0)) is None


@every_motion
def test_a_solid_that_holds_the_whole_operation_inside_is_hit(motion: FloatArray) -> None:
    """No surface of it is near the hand or its motion: only the way out of it tells."""
    assert hit(motion, about((0.0, 0.0, 0.0), 4000.0)) is not None


@every_motion
def test_a_closed_hollow_around_the_whole_operation_is_hit_and_an_open_one_is_not(motion: FloatArray) -> None:
    closed = about((0.0, 0.0, 0.0), 4000.0) - about((0.0, 0.0, 0.0), 3900.0)
    opened = closed - box((-1000.0, -1000.0, 0.0), (1000.0, 1000.0, 3000.0))

    assert hit(motion, closed) is not None
    assert hit(motion, opened) is None


@every_motion
@pytest.mark.parametrize("share", [0.0, 0.31, 0.5, 0.87, 1.0])
@pytest.mark.parametrize("part", ["finger 1", "finger 2", "the palm"])
def test_a_speck_that_a_part_of_the_hand_swallows_whole_is_hit(motion: FloatArray, share: float, part: str) -> None:
    """Half-way through the finger's section, 1 above its tip; in the palm 1 behind its front. Never near its surface."""
    points = {"finger 1": (14.0, 0.0, 16.0), "finger 2": (-14.0, 0.0, 16.0), "the palm": (3.0, 2.0, PALM_MM + 1.0)}
    if motion is SCREWED_IN:
        left = (1.0 - share) * TURNS
        place = displaced(z=PITCH_MM * left, turn_deg=360.0 * left)
    else:
        place = displaced(*((1.0 - share) * motion[0][:3, 3]))
    x, y, z = (place @ [*points[part], 1.0])[:3]

    assert hit(motion, about((x, y, z), 0.2)) is not None


# --- touching ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("gap_mm", "free"), [(0.0, False), (MARGIN_MM - 0.005, False), (MARGIN_MM + 0.005, True)])
def test_a_floor_below_the_tips_of_a_lowered_hand_keeps_the_margin(gap_mm: float, free: bool) -> None:
    floor = box((-60.0, -60.0, -5.0), (60.0, 60.0, TIPS_MM - gap_mm)) - about((0.0, 0.0, 10.0), 22.0)

    assert (hit(LOWERED, floor) is None) is free


@pytest.mark.parametrize(("gap_mm", "free"), [(0.0, False), (MARGIN_MM - 0.005, False), (MARGIN_MM + 0.005, True)])
def test_a_wall_that_a_pushed_in_hand_passes_keeps_the_margin(gap_mm: float, free: bool) -> None:
    """It stands where the open gripper never is: between start and end."""
    wall = box((OUTSIDE_MM + gap_mm, 40.0, 0.0), (40.0, 60.0, 70.0))

    assert (hit(PUSHED_IN, wall) is None) is free


@pytest.mark.parametrize(
    ("gap_mm", "free"), [(0.0, False), (MARGIN_MM - 0.005, False), (MARGIN_MM + ARC_MM, True)], ids=["0", "less", "more"]
)
def test_a_bore_that_a_hand_turns_in_keeps_the_margin(gap_mm: float, free: bool) -> None:
    """Without release nothing but the turning fingers comes near it: their outer edges, at `TURNED_MM`."""
    assert (hit(SCREWED_IN, ring(TURNED_MM + gap_mm, 0.0, 70.0), release_mm=0.0) is None) is free


@pytest.mark.parametrize(
    ("gap_mm", "free"), [(0.0, False), (MARGIN_MM - 0.005, False), (MARGIN_MM + 0.005, True)], ids=["0", "less", "more"]
)
def test_a_floor_below_a_hand_that_is_screwed_down_keeps_the_margin(gap_mm: float, free: bool) -> None:
    floor = ring(15.0, -5.0, TIPS_MM - gap_mm)

    assert (hit(SCREWED_IN, floor) is None) is free


@every_motion
@pytest.mark.parametrize(("gap_mm", "free"), [(0.0, False), (MARGIN_MM - 0.005, False), (MARGIN_MM + 0.005, True)])
def test_a_post_beside_the_component_below_the_palm_keeps_the_margin(motion: FloatArray, gap_mm: float, free: bool) -> None:
    """Beside the fingers by more than they reach at any turn, below the palm's rim: of a palm that turns, too."""
    post = box((-2.0, 21.0, 0.0), (2.0, 24.0, PALM_MM - gap_mm))

    assert (hit(motion, post) is None) is free


# --- thin --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("y_mm", [21.7, 37.123, 50.0, 83.0])
def test_a_sheet_across_the_way_of_a_pushed_in_hand_is_hit(y_mm: float) -> None:
    sheet = box((12.0, y_mm, 16.0), (14.0, y_mm + 0.01, 18.0))

    assert hit(PUSHED_IN, sheet) is not None
    assert hit(PUSHED_IN, sheet.translate((12.0, 0.0, 0.0))) is None


@pytest.mark.parametrize("turn_deg", [50.0, 67.5, 81.3, 90.0, 119.99])
@pytest.mark.parametrize("level_mm", [PALM_MM - 9.0, TIPS_MM + 1.0])
def test_a_sheet_across_the_way_of_a_turning_finger_is_hit(turn_deg: float, level_mm: float) -> None:
    """On edge, at angles where no finger stands at the start or the end, nor on its way out."""
    upright = box((12.0, -0.005, level_mm), (17.0, 0.005, level_mm + 2.0)).rotate((0.0, 0.0, turn_deg))

    assert hit(SCREWED_IN, upright) is not None
    assert hit(SCREWED_IN, upright.translate((200.0, 0.0, 0.0))) is None


def test_a_sheet_below_the_palm_that_only_the_last_turn_reaches_is_hit() -> None:
    """At 22 to 24 from the axis, 0.5 above the palm's front at its seat: the palm comes down to it in the last quarter turn."""
    sheet = box((-1.0, 22.0, PALM_MM + 0.5), (1.0, 24.0, PALM_MM + 0.51))

    assert hit(SCREWED_IN, sheet) is not None
    assert hit(SCREWED_IN, sheet.translate((0.0, 0.0, -0.7))) is None


# --- hollow ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("bore_mm", "free"), [(OPEN_MM + 0.01, True), (OPEN_MM - 0.01, False), (TURNED_MM - 1.0, False)])
def test_fingers_pass_down_through_a_ring_that_leaves_them_room(bore_mm: float, free: bool) -> None:
    """Open, with the margin, their edges stand at `OPEN_MM`: they leave through the ring."""
    assert (hit(LOWERED, ring(bore_mm, 20.0, 40.0)) is None) is free


@pytest.mark.parametrize(("bore_mm", "free"), [(OPEN_MM + ARC_MM, True), (OPEN_MM - 0.01, False), (TURNED_MM - 1.0, False)])
def test_fingers_turn_in_a_ring_that_leaves_them_room(bore_mm: float, free: bool) -> None:
    """At the middle of the fingers, away from the tips and the palm."""
    assert (hit(SCREWED_IN, ring(bore_mm, 30.0, 40.0)) is None) is free


@pytest.mark.parametrize(
    ("room_mm", "free"),
    [
        (OUTSIDE_MM + RELEASE_MM / 2.0 + MARGIN_MM + 0.005, True),
        (OUTSIDE_MM + RELEASE_MM / 2.0 + MARGIN_MM - 0.005, False),
        (OUTSIDE_MM - 1.0, False),
    ],
)
@pytest.mark.parametrize("motion", [LOWERED, PUSHED_IN], ids=["lowered", "pushed in"])
def test_a_channel_lets_the_hand_pass_along_it(motion: FloatArray, room_mm: float, free: bool) -> None:
    """A U along y, its floor below the component, its hull around all of the fingers: free where its walls leave room."""
    channel = box((-60.0, -150.0, -20.0), (60.0, 150.0, 60.0)) - box((-room_mm, -200.0, -2.0), (room_mm, 200.0, 70.0))

    assert (hit(motion, channel) is None) is free


def test_a_ring_with_a_gap_is_hit_by_the_finger_that_turns_out_of_the_gap() -> None:
    """Gaps stand where the fingers end, before and after the turns: a hand that is lowered passes, one that turns does not."""
    tight = ring(14.0, 20.0, 40.0) - box((-60.0, -5.3, 0.0), (60.0, 5.3, 60.0))

    assert hit(LOWERED, tight) is None
    assert hit(SCREWED_IN, tight) is not None
