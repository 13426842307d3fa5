"""The grip by a face: a hand that does not close, whatever holds it."""

import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gripwright.design.actuation import HoldPolicy, Shortfall, classes_of
from gripwright.design.catalogue import actuator_envelope_mm, actuators_from_csv, jaw_offset_mm, palm_envelope_mm, why_not
from gripwright.design.contact import forbidden_touch
from gripwright.design.finger_lengths import length_max, length_min
from gripwright.design.hand_check import HandCheck, OperationScene
from gripwright.design.hand_volumes import HandVolumes
from gripwright.design.plan import plan_of
from gripwright.design.records import dumps
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.errors import InvalidPlan
from gripwright.domain.grasp import SURFACE, FreeGrasp, Grasp, GraspConstraint, Hold
from gripwright.domain.gripper import NO_STROKE, Actuator, GripperParameters
from gripwright.domain.gripper_set import ComponentAlternatives, GripperClass, GripperSetProblem
from gripwright.domain.shape import Mesh
from gripwright.geometry.collision import MeshSurface, PlacedSurface, Scene
from gripwright.geometry.held_surface import SEAT_MM, Surface
from gripwright.plugin_api import RunContext
from gripwright.testing.sample_hands import SampleFace
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer, SetCoverParams
from mesh_factory import box_mesh, moved

FACE = "face-1"
WIDE = SampleFace(FACE, 20.0)


class CupOnAStem(SampleFace):
    """A cup of the face's width and 10 mm high, on a stem of 4 mm."""

    def finger(self, finger_length_mm: float, grip: str):
        (cup,) = super().finger(10.0, grip)
        stem = replace(cup, vertices_mm=cup.vertices_mm * [0.2, 0.2, finger_length_mm / 10.0], role="stem")
        return cup, stem


CUP = CupOnAStem(FACE, 20.0)


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    X = np.eye(4)
    X[:3, 3] = low
    return moved(box_mesh((high[0] - low[0], high[1] - low[1], high[2] - low[2])), X)


PLATE = block((-40.0, -40.0, -5.0), (40.0, 40.0, 0.0))


def from_above(x: float = 0.0, off_mm: float = SEAT_MM) -> Grasp:
    X = np.diag([1.0, -1.0, -1.0, 1.0])
    X[:3, 3] = x, 0.0, off_mm
    return Grasp(X_CG=X, gripper_type=FACE, grip=SURFACE, opening_width_mm=20.0)


def check(*standing: Mesh, hand: SampleFace = WIDE) -> HandCheck:
    """The plate lowered by 100 mm to where it lies, among what stands there."""
    way = np.stack([np.eye(4), np.eye(4)])
    way[0, 2, 3] = 100.0
    scene = OperationScene(
        attached=Scene([PlacedSurface(name="plate", surface=MeshSurface(PLATE), X=np.eye(4))]),
        standing=Scene([PlacedSurface(name=f"block {i}", surface=MeshSurface(m), X=np.eye(4)) for i, m in enumerate(standing)]),
        X_PC=np.eye(4),
        motion=way,
        margin_mm=0.1,
        release_clearance_mm=1.0,
    )
    return HandCheck(scene, hand)


def test_a_seated_face_may_touch_with_its_front() -> None:
    assert check().seated(from_above(), 30.0) is None


def test_a_face_that_enters_the_component_is_not_free() -> None:
    miss = check().seated(from_above(off_mm=-0.05), 30.0)

    assert miss is not None
    assert miss.code == "collision"


@pytest.mark.parametrize(("wall", "free"), [(10.05, False), (10.2, True)])
def test_beside_a_wall_the_face_keeps_the_margin_and_needs_no_room_to_open(wall: float, free: bool) -> None:
    wall_mesh = block((wall, -40.0, 0.0), (wall + 5.0, 40.0, 20.0))

    assert (check(wall_mesh).seated(from_above(), 30.0) is None) is free


def test_a_face_leaves_with_its_whole_width_along_the_approach() -> None:
    """A ledge over the lip, beside the thin stem: the cup cannot pass it."""
    ledge = block((5.0, -40.0, 15.0), (40.0, 40.0, 18.0))

    miss = check(ledge, hand=CUP).seated(from_above(), 60.0)

    assert miss is not None
    assert "block 0" in miss.detail


def test_what_is_in_the_way_of_the_way_out_is_measured_too() -> None:
    ledge = block((5.0, -40.0, 15.0), (40.0, 40.0, 18.0))
    asked = check(ledge, hand=CUP)

    volumes = HandVolumes(asked.scene, CUP)
    found = [one for volume in volumes.leaving(from_above(), 30.0) for one in volumes.intrusions(volume)]

    assert {one.body.name for one in found} == {"block 0"}
    assert max(one.depth_mm for one in found) == pytest.approx(5.1, abs=0.3)  # the lip's radius less the ledge's edge


def test_the_palm_may_be_narrower_than_the_face_and_bounds_the_length() -> None:
    """A bridge from z = 40 to 50 beside the face: the palm (radius 30) has to stay above it."""
    bridge = block((12.0, -40.0, 0.0), (40.0, 40.0, 50.0))

    lengths, miss = length_min(check(bridge), from_above(), np.array([8.0, 30.0]), 5.0)

    assert miss is None
    assert lengths[0] == 5.0
    assert lengths[1] == pytest.approx(50.0 + 0.1, abs=0.02)


def test_a_cup_does_not_bound_how_long_its_stem_may_be() -> None:
    assert length_max(check(hand=CUP), from_above(), 20.0)[0] == np.inf


def test_surface_that_must_not_be_touched_counts_where_the_face_lies_on_it() -> None:
    region = Forbidden(reason="ground", detector="marked", faces=np.ones(len(PLATE.faces), dtype=bool),
                       box_min_C=np.array([0.0, -5.0, -1.0]), box_max_C=np.array([40.0, 5.0, 1.0]))  # fmt: skip
    regions = [(region, Surface(PLATE))]

    touched = forbidden_touch(from_above(-9.0), regions, WIDE, 30.0)

    assert touched is not None
    assert touched.code == "no-grasp"
    assert forbidden_touch(from_above(-10.2), regions, WIDE, 30.0) is None


@pytest.mark.parametrize(("width", "held"), [(20.0, True), (19.999, False), (20.001, False)])
def test_a_face_holds_what_asks_for_its_size_and_needs_no_release(width: float, held: bool) -> None:
    gripper = GripperParameters(gripper_type=FACE, opening_min_mm=20.0, opening_max_mm=20.0, finger_length_mm=30.0, grip=SURFACE)
    asked = GraspConstraint(gripper_type=FACE, opening_width_mm=width, finger_length_min_mm=10.0, finger_length_max_mm=40.0)

    assert gripper.satisfies(asked, 1.0) is held


def test_the_set_cover_shares_one_size_among_components_that_may_choose() -> None:
    def alternatives(*widths: float) -> tuple[GraspConstraint, ...]:
        return tuple(
            GraspConstraint(gripper_type=FACE, opening_width_mm=w, finger_length_min_mm=20.0, finger_length_max_mm=60.0)
            for w in widths
        )

    components = [("a", (50.0, 32.0, 20.0)), ("b", (32.0, 20.0)), ("c", (20.0, 13.0)), ("d", (80.0,))]
    problem = GripperSetProblem(
        classes={FACE: GripperClass(stroke_mm=0.0, grip=SURFACE)},
        components=tuple(ComponentAlternatives(id=name, alternatives=alternatives(*widths)) for name, widths in components),
        release_clearance_mm=1.0,
        in_sequence=True,
    )

    solution = SetCoverOptimizer(SetCoverParams()).solve(problem, RunContext())

    assert solution.proven
    assert [(one.parameters.opening_min_mm, one.parameters.opening_max_mm) for one in solution.grippers] == [
        (20.0, 20.0),
        (80.0, 80.0),
    ]
    assert not solution.uncoverable


def actuator(**figures: Any) -> Actuator:
    told = {
        "maker": "M",
        "model": "E",
        "gripper_type": FACE,
        "stroke_mm": 0.0,
        "stroke_basis": NO_STROKE,
        "body_diameter_mm": 40.0,
    }
    return Actuator(**{**told, **figures})


def test_an_actuator_without_jaws_may_be_chosen_and_has_no_offset() -> None:
    one = actuator()

    assert why_not(one) is None
    assert why_not(replace(one, stroke_basis="total")) is not None
    assert jaw_offset_mm(one, 50.0) == 0.0
    assert actuator_envelope_mm(one) == palm_envelope_mm(one, 80.0) == 20.0


def test_the_catalogue_reads_rows_without_jaws() -> None:
    (one,), faults = actuators_from_csv(
        "maker,model,type,fingers,stroke_basis,opening_min_mm,opening_max_mm,grip_force_N\nM,E,vacuum,1,none,8,50,100\n"
    )

    assert not faults
    assert (one.gripper_type, one.stroke_mm, one.closes, one.opening_max_mm, one.confidence) == (
        "vacuum-1",
        0.0,
        False,
        50.0,
        "B",
    )


class ByArea:
    """A holding model that knows forces alone."""

    def grip_force_N(self, one: Actuator, opening_width_mm: float) -> float | None:
        assert one.grip_force_N is not None
        assert one.opening_max_mm is not None
        return one.grip_force_N * (opening_width_mm / one.opening_max_mm) ** 2


@pytest.mark.parametrize(
    ("width", "needed_N", "code"), [(20.0, 8.0, None), (20.0, 8.1, "not-held"), (40.0, 32.0, None), (41.0, 1.0, "too-wide")]
)
def test_an_actuator_serves_faces_up_to_its_largest_with_the_force_of_their_size(width, needed_N, code) -> None:
    one = actuator(opening_max_mm=40.0, grip_force_N=64.0)
    free = FreeGrasp(
        grasp=replace(from_above(), opening_width_mm=width),
        envelopes_mm=np.array([20.0]),
        finger_length_min_mm=np.array([15.0]),
        finger_length_max_mm=np.inf,
        release_opening_mm=width,
        gap_mm=1.0,
        hold=Hold(required_force_N=needed_N, moment_Nmm=0.0, symmetry=1.0),
    )
    (kind,) = classes_of([one], {one.name: 1.0}, [free], WIDE, SURFACE)

    answer = kind.constraint(free, 1.0, HoldPolicy(safety_factor=2.0, enforced=True, models={FACE: ByArea()}))

    assert (answer.code if isinstance(answer, Shortfall) else None) == code
    if isinstance(answer, GraspConstraint):
        assert (answer.opening_width_mm, answer.release_clearance_mm) == (width, 0.0)


def test_a_field_that_came_later_leaves_the_record_of_what_does_not_use_it_as_it_was() -> None:
    plain = Component(id="a", mesh=PLATE, X_PC=np.eye(4))

    assert b"texture" not in zlib.decompress(dumps(plain)[12:])
    assert dumps(plain) == dumps(replace(plain, texture=None, ferrous=None))
    assert dumps(plain) != dumps(replace(plain, ferrous=True))


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("straight", "straight"),
        (["straight"], "straight"),
        (["straight", "suction_cup"], ("straight", "suction_cup")),
        ("straight, suction_cup", ("straight", "suction_cup")),
    ],
)
def test_a_plan_names_one_finger_designer_or_several(given, kept) -> None:
    assert plan_of({"finger": given}).finger == kept


def test_a_plan_without_a_finger_designer_is_refused() -> None:
    with pytest.raises(InvalidPlan, match="not a plan"):
        plan_of({"finger": []})
