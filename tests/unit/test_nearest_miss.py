"""Why nothing holds: what is in the way, where and by how much, against closed forms; and in words."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gripwright.design.grasp_judge import GraspJudge
from gripwright.design.hand_check import Miss
from gripwright.design.scenes import Body, held_component, operation_scene
from gripwright.design.shortfall import without_grasp
from gripwright.design.stages.constraints import SegmentSearch
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component, Obstacle, Operation
from gripwright.domain.grasp import (
    CENTRIC_3,
    EXTERNAL,
    INTERNAL,
    PARALLEL_2,
    Grasp,
    GripRequirement,
    NearestMiss,
    OperationVerdict,
    SegmentVerdict,
)
from gripwright.domain.shape import Box, Cylinder, FloatArray, Mesh
from gripwright.geometry.frames import pose
from gripwright.plugin_api import RunContext
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from mesh_factory import box_mesh, moved

DOWN, X_AXIS = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
THICK_MM, WIDE_MM, MARGIN_MM, RELEASE_MM = 8.0, 10.0, 0.1, 1.0  # of the finger, of the checks


def block(low: Sequence[float], high: Sequence[float]) -> Mesh:
    X = np.eye(4)
    X[:3, 3] = low
    return moved(box_mesh((high[0] - low[0], high[1] - low[1], high[2] - low[2])), X)


HELD = block((-10.0, -10.0, 0.0), (10.0, 10.0, 20.0))


def grasp(depth: float = 5.0, width: float = 20.0, top: float = 20.0) -> Grasp:
    """From above, the tips `depth` below the block's top."""
    X = pose(X_AXIS, np.cross(DOWN, X_AXIS), DOWN, np.array([0.0, 0.0, top - depth]))
    return Grasp(X_CG=X, gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=width, label=f"{depth:g} mm deep")


def box_need(mesh: Mesh, width: float) -> GripRequirement:
    low, high = mesh.vertices_mm.min(axis=0), mesh.vertices_mm.max(axis=0)
    X = np.eye(4)
    X[:3, 3] = (low + high) / 2.0
    box = Box(X_CB=X, extents_mm=high - low, filled=np.ones(6), filled_min=0.5, rms_mm=0.0)
    return GripRequirement(
        gripper_type=PARALLEL_2,
        opening_width_mm=width,
        approach_C=np.zeros((0, 3)),
        grip_axes_C=X_AXIS[None],
        primitive=box,
    )


def judged(
    *standing: Mesh,
    grasps: Sequence[Grasp],
    held: Mesh = HELD,
    motion: FloatArray | None = None,
    friction: float = 0.5,
    forbidden: tuple[Forbidden, ...] = (),
    needs: Sequence[GripRequirement] | None = None,
    margin: float = MARGIN_MM,
    envelope: float = 15.0,
) -> SegmentVerdict:
    """What becomes of a segment on which those grasps are planned: a block set down from 100 mm above among others."""
    way = np.stack([np.eye(4), np.eye(4)])
    way[0, 2, 3] = 100.0
    component = Component(id="block", mesh=held, X_PC=np.eye(4), friction=friction, density_kg_m3=1000.0)
    operation = Operation(id="op", active=("block",), passive=(), motion=way if motion is None else motion)
    obstacles = [Obstacle(id=f"wall-{i}", mesh=mesh, X_PE=np.eye(4)) for i, mesh in enumerate(standing, start=1)]
    body = Body(component=component, solid=held)
    scene = operation_scene(operation, body, [], [], obstacles, margin, RELEASE_MM)
    asked = [box_need(held, 20.0)] if needs is None else needs
    toolbox: Any = SimpleNamespace(
        hands={PARALLEL_2: ParallelHand(HandSettings()), CENTRIC_3: CentricHand(CentricSettings())},
        planners={kind: [SimpleNamespace(key="named", plan=lambda *_: grasps)] for kind in (PARALLEL_2, CENTRIC_3)},
    )
    analysis: Any = SimpleNamespace(segment=SimpleNamespace(id=2, faces=np.arange(len(held.faces))))
    ctx = RunContext(min_contact_mm=3.0)
    judge = GraspJudge(held_component(operation, body, [], held, forbidden), scene, lambda kind, width: np.array([envelope]), ctx)
    search = SegmentSearch(analysis, asked, judge, toolbox, ctx)
    search.planned()
    return search.verdict("")


def miss_of(verdict: SegmentVerdict) -> NearestMiss:
    assert not verdict.free
    assert verdict.rejection is not None
    assert verdict.nearest_miss is not None
    assert verdict.rejection.code == verdict.nearest_miss.code
    assert verdict.rejection.detail.startswith(verdict.nearest_miss.sentence)
    return verdict.nearest_miss


def test_a_free_segment_has_no_miss() -> None:
    verdict = judged(grasps=[grasp()])

    assert verdict.free
    assert verdict.nearest_miss is None


@pytest.mark.parametrize(
    ("taper", "told"), [(0.0, ": no parallel facets, or no height"), (-0.1, ", tapered 5.7° towards the palm")]
)
def test_where_nothing_is_planned_the_planners_and_what_they_were_asked_for_are_named(taper: float, told: str) -> None:
    need = replace(box_need(HELD, 20.0), rule="two_finger_box", taper_rad=taper)

    verdict = judged(grasps=[], needs=[need])

    assert verdict.nearest_miss is None
    assert verdict.rejection is not None
    assert verdict.rejection.detail == f"named plans no grasp for two_finger_box on the box at 20.0 mm{told}"


@pytest.mark.parametrize(("other", "planned"), [(HELD, 2), (block((-10.0, -10.0, 0.0), (10.0, 10.0, 12.0)), 1)])
def test_another_primitive_is_asked_beside_the_first_where_as_much_of_the_surface_lies_on_it(other: Mesh, planned: int) -> None:
    verdict = judged(grasps=[grasp()], needs=[box_need(HELD, 20.0), box_need(other, 20.0)])

    assert (verdict.grasps_planned, len(verdict.free)) == (planned, planned)


@pytest.mark.parametrize("into", [0.02, 1.8])
def test_a_wall_that_the_closed_finger_meets_on_the_way_is_named_with_depth_and_height(into: float) -> None:
    inner = 10.0 + THICK_MM - into  # beside finger 1, from 12 mm above the tips at the seat downwards
    wall = block((inner, -30.0, 0.0), (inner + 50.0, 30.0, 27.0))

    miss = miss_of(judged(wall, grasps=[grasp(depth=5.0)]))

    assert (miss.code, miss.part, miss.hit, miss.side) == ("collision", "finger 1", "wall-1", "outer face")
    assert miss.unit == "mm"
    assert miss.found is not None
    assert miss.found == pytest.approx(-into, abs=0.5 * RELEASE_MM + 0.01)
    assert miss.limit == MARGIN_MM
    assert miss.amount == pytest.approx(miss.limit - miss.found)
    assert miss.phase == "motion"
    assert miss.found == pytest.approx(-into, abs=0.003)
    assert miss.place == pytest.approx(1.0 - (12.0 + MARGIN_MM) / 100.0, abs=0.002)
    assert "on the way down, from 12.1 mm above its seat onwards" in miss.sentence
    assert f"would enter 'wall-1' by {into:.2f} mm" in miss.sentence
    assert "gripped across 20.0 mm (segment 2)" in miss.sentence


def test_a_pocket_too_narrow_by_a_millimetre_is_short_of_just_that() -> None:
    room = THICK_MM + RELEASE_MM / 2.0 + MARGIN_MM  # what the opened finger takes, with its margin
    walls = [
        block((10.0 + room - 1.0, -30.0, 0.0), (80.0, 30.0, 25.0)),
        block((-80.0, -30.0, 0.0), (-10.0 - room + 1.0, 30.0, 25.0)),
    ]

    miss = miss_of(judged(*walls, grasps=[grasp(depth=6.0)]))

    assert miss.amount == pytest.approx(1.0 - RELEASE_MM / 2.0, abs=0.003)  # told is the closed finger: it comes first
    assert miss.hit in ("wall-1", "wall-2")  # alike
    assert (miss.side, miss.phase) == ("outer face", "motion")


def test_a_head_that_stands_out_three_millimetres_lacks_the_margin_below_the_tips() -> None:
    head = block((-10.0, -10.0, 0.0), (10.0, 10.0, 3.0))
    plate = block((-60.0, -60.0, -10.0), (60.0, 60.0, 0.0))

    miss = miss_of(judged(plate, held=head, grasps=[grasp(depth=3.0, top=3.0)], needs=[box_need(head, 20.0)]))

    assert (miss.hit, miss.side) == ("wall-1", "tip")
    assert miss.amount == pytest.approx(0.1, abs=0.002)
    assert miss.found == pytest.approx(0.0, abs=0.002)
    assert "would touch 'wall-1' (0.10 mm of clearance is required) with its tip" in miss.sentence
    assert "as it reaches its seat" in miss.sentence


def test_a_finger_that_has_no_room_at_all_is_in_the_way_with_its_whole_thickness() -> None:
    wall = block((10.0, -30.0, 0.0), (60.0, 30.0, 27.0))

    miss = miss_of(judged(wall, grasps=[grasp()]))

    assert miss.amount == pytest.approx(THICK_MM + MARGIN_MM, abs=0.003)
    assert "would run into 'wall-1' with its whole thickness of 8.00 mm," in miss.sentence


def test_of_several_grasps_the_one_that_lacks_least_is_told_with_its_pose() -> None:
    floor = [block((12.0, -60.0, 0.0), (60.0, 60.0, 6.0)), block((-60.0, -60.0, 0.0), (-12.0, 60.0, 6.0))]
    depths = [19.0, 17.0, 14.5, 16.0]

    miss = miss_of(judged(*floor, grasps=[grasp(depth=depth) for depth in depths]))

    assert miss.grasp is not None
    assert miss.grasp.label == "14.5 mm deep"  # its tips at 5.5, the floor at 6
    assert miss.amount == pytest.approx(0.5 + MARGIN_MM, abs=0.002)


def test_a_contact_too_low_states_the_height_found_and_the_height_needed() -> None:
    miss = miss_of(judged(grasps=[grasp(depth=2.25)]))

    assert (miss.code, miss.quantity, miss.phase) == ("no-contact", "contact height", "holding")
    assert (miss.found, miss.limit, miss.amount) == pytest.approx((2.25, 3.0, 0.75))
    assert "would touch along 2.25 mm of its height only, at least 3.00 mm is required" in miss.sentence


def test_a_finger_beside_the_component_touches_nothing() -> None:
    aside = grasp()
    aside.X_CG[1, 3] = 40.0

    miss = miss_of(judged(grasps=[aside]))

    assert miss.code == "no-contact"
    assert miss.found == 0.0
    assert "would touch nothing" in miss.sentence


def test_a_roof_over_everything_stops_the_palm_however_long_the_fingers() -> None:
    roof = block((-4.0, -4.0, 300.0), (4.0, 4.0, 305.0))
    still = np.stack([np.eye(4), np.eye(4)])

    miss = miss_of(judged(roof, grasps=[grasp()], motion=still))

    assert (miss.part, miss.hit) == ("the palm", "wall-1")
    assert miss.palm_radius_mm == 15.0
    assert miss.amount == pytest.approx(15.0 + 4.0 + MARGIN_MM, abs=0.001)  # out through the rim
    assert "even behind fingers of 250 mm" in miss.sentence


def test_forbidden_surface_is_told_with_how_far_the_tips_reach_over_it() -> None:
    region = Forbidden(
        reason="the seal",
        detector="marked",
        faces=np.ones(len(HELD.faces), dtype=bool),
        box_min_C=np.array([-11.0, -11.0, 0.0]),
        box_max_C=np.array([11.0, 11.0, 16.3]),
    )

    miss = miss_of(judged(grasps=[grasp(depth=5.0)], forbidden=(region,)))

    assert miss.code == "no-grasp"
    assert miss.amount == pytest.approx(1.3, abs=0.01)  # the tips end at 15
    assert "would reach 1.30 mm over the seal, which must not be touched" in miss.sentence


def test_a_bore_too_narrow_for_the_fingers_states_what_is_missing() -> None:
    bore = Cylinder(
        axis_C=np.array([0.0, 0.0, 1.0]),
        center_C=np.zeros(3),
        radius_mm=4.0,
        height_mm=10.0,
        internal=True,
        arc_rad=2.0 * np.pi,
        rms_mm=0.0,
        surface_filled=True,
    )
    need = GripRequirement(
        gripper_type=CENTRIC_3,
        opening_width_mm=8.0,
        grip=INTERNAL,
        approach_C=DOWN[None],
        grip_axes_C=np.zeros((0, 3)),
        primitive=bore,
    )

    miss = miss_of(judged(grasps=[], needs=[need]))

    assert miss.code == "too-narrow"
    assert miss.grasp is None
    assert (miss.found, miss.limit, miss.amount) == pytest.approx((8.0, 9.0, 1.0))
    assert "gripped from inside Ø8.0 mm (segment 2) the bore is too narrow for 3 fingers by 1.00 mm" in miss.sentence.replace(
        ",", ""
    )


@pytest.mark.parametrize("seed", range(12))
def test_what_is_measured_fails_wherever_the_check_says_so_and_nowhere_else(seed: int) -> None:
    rng = np.random.default_rng(seed)
    walls = []
    for _ in range(3):
        low = rng.uniform([-35.0, -35.0, -5.0], [30.0, 30.0, 60.0])
        walls.append(block(low, low + rng.uniform(2.0, 12.0, 3)))

    verdict = judged(*walls, grasps=[grasp(depth=rng.uniform(4.0, 12.0))], envelope=20.0)

    assert (verdict.nearest_miss is None) == bool(verdict.free)
    if verdict.nearest_miss is not None:
        assert verdict.nearest_miss.amount is not None
        assert verdict.nearest_miss.amount > 0.0


@pytest.mark.parametrize("seed", range(12))
def test_the_hit_body_moved_out_by_the_amount_is_no_longer_hit(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    into = rng.uniform(0.2, 3.0)
    side = rng.choice([1.0, -1.0])
    low = np.array([10.0 + THICK_MM - into, -rng.uniform(4.0, 30.0), 0.0])
    high = np.array([60.0, rng.uniform(4.0, 30.0), rng.uniform(21.0, 40.0)])
    corners = np.stack([low, high]) * [side, 1.0, 1.0]
    planned = [grasp(depth=5.0)]

    miss = miss_of(judged(block(corners.min(axis=0), corners.max(axis=0)), grasps=planned))
    assert miss.amount is not None
    out = np.array([side * (miss.amount + RELEASE_MM / 2.0 + 0.01), 0.0, 0.0])  # the told phase may be the closed one

    assert judged(block(corners.min(axis=0) + out, corners.max(axis=0) + out), grasps=planned).free


def test_an_operation_is_told_by_the_segment_that_came_closest() -> None:
    wall = block((16.2, -30.0, 0.0), (60.0, 30.0, 27.0))
    near, far = judged(wall, grasps=[grasp()]), judged(grasps=[grasp(depth=2.25)])
    verdict = OperationVerdict(operation="op", components={"block": (near, far)}, warnings=(), timings={})

    told = without_grasp(verdict)

    assert far.nearest_miss is not None
    assert told.startswith("block cannot be held in op: " + far.nearest_miss.sentence)
    assert told.endswith("that is the closest found of 2 grasps on 2 segments")


def test_the_grasp_of_a_miss_is_kept_beside_what_misses_are_counted_by() -> None:
    one, other = (Miss(stage=1, code="collision", detail="x", grasp=grasp(depth=depth)) for depth in (4.0, 5.0))

    assert one == other
    assert hash(one) == hash(other)
