"""Tapered tips: their geometry, what they touch and hold, and their place in the gripper set, against closed forms."""

from dataclasses import replace
from typing import Any

import manifold3d
import numpy as np
import pytest

from gripwright.design.contact import Contact, Surface, contacts, seat
from gripwright.design.grooved_hand import hand_of
from gripwright.design.hand_check import HandCheck
from gripwright.design.holding import hold
from gripwright.design.holding_load import operation_load
from gripwright.design.scenes import Body, operation_scene
from gripwright.design.stages.fingers import GripperCad, design_gripper_cad
from gripwright.design.stages.verify import verify_handle
from gripwright.design.tapered_hand import TaperedHand, tapered
from gripwright.domain.assembly import Component, Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, INTERNAL, PARALLEL_2, Grasp, GripRequirement, Hold
from gripwright.domain.gripper import Actuator, FingerDesign, FingerSpec, Gripper, Handle
from gripwright.domain.shape import Cylinder, Mesh
from gripwright.domain.taper import Taper
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.measures import face_areas_mm2
from gripwright.plugin_api import FingerDesigner, HandModel, RunContext
from gripwright_builtin.fingers.straight import StraightFinger, StraightFingerParams
from gripwright_builtin.hands.centric import CentricHand, CentricSettings, FourFingerHand
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from mesh_factory import mesh_of

THREE, FOUR, TWO = CentricHand(CentricSettings()), FourFingerHand(CentricSettings()), ParallelHand(HandSettings())
DESIGNER = StraightFinger(StraightFingerParams())
RADIUS_MM, HEIGHT_MM = 18.0, 30.0
ACTUATOR = Actuator(
    maker="Maker", model="M1", gripper_type=CENTRIC_3, stroke_mm=16.0, opening_max_mm=30.0, grip_force_N=200.0,
    body_diameter_mm=60.0, body_length_mm=50.0,
)  # fmt: skip


def cone(degrees: float, sections: int = 192) -> Mesh:
    """A frustum of a cone whose foot, of radius 18, stands at z = 0; 30 high."""
    top = RADIUS_MM - HEIGHT_MM * np.tan(np.radians(degrees))
    return mesh_of(manifold3d.Manifold.cylinder(HEIGHT_MM, RADIUS_MM, top, sections))


def pyramid(degrees: float) -> Mesh:
    """A frustum of a square pyramid, its foot 36 × 36 at z = 0; 30 high, its sides along x and y."""
    half = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    foot, top = RADIUS_MM, RADIUS_MM - HEIGHT_MM * np.tan(np.radians(degrees))
    corners = [np.column_stack([half * r, np.full(4, z)]) for r, z in ((foot, 0.0), (top, HEIGHT_MM))]
    return mesh_of(manifold3d.Manifold.hull_points(np.concatenate(corners)))


def grasp_of(degrees: float, depth_mm: float, gripper_type: str = CENTRIC_3, taper_degrees: float | None = None) -> Grasp:
    """From above, tips `depth_mm` below the narrow end (a negative angle), or from below, as far above the foot."""
    taper = Taper(angle_rad=float(np.radians(degrees if taper_degrees is None else taper_degrees)))
    above, slope = degrees < 0.0, np.tan(np.radians(abs(degrees)))
    z = HEIGHT_MM - depth_mm if above else depth_mm
    X = np.diag([1.0, -1.0, -1.0, 1.0]) if above else np.eye(4)
    X[2, 3] = z
    return Grasp(
        X_CG=X,
        gripper_type=gripper_type,
        grip=EXTERNAL,
        opening_width_mm=2.0 * (RADIUS_MM - z * slope - taper.tip_mm),
        taper_rad=taper.angle_rad,
    )


@pytest.mark.parametrize("degrees", [-20.0, -5.0, 5.0, 20.0])
@pytest.mark.parametrize("flat", [THREE, FOUR, TWO])
def test_a_tapered_finger_is_a_wedge_before_a_stem_as_thick_as_a_flat_one(flat: HandModel, degrees: float) -> None:
    taper = Taper(angle_rad=float(np.radians(degrees)))
    hand = TaperedHand(flat, taper)
    tip, stem = (solid.vertices_mm for solid in hand.finger(30.0, EXTERNAL))

    along = transform(inverse(taper.X_FP), tip)  # before the inclined plane is nothing, and one side of the wedge lies in it
    assert along[:, 0].min() == pytest.approx(0.0, abs=1e-9)
    assert (np.abs(along[:, 0]) < 1e-9).sum() == 4
    assert min(tip[:, 0].min(), stem[:, 0].min()) == pytest.approx(0.0, abs=1e-12)
    assert tip[:, 0].max() == stem[:, 0].max() == pytest.approx(8.0 + 10.0 * np.tan(np.radians(abs(degrees))))
    assert (tip[:, 2].min(), stem[:, 2].min(), stem[:, 2].max()) == (-10.0, -30.0, -10.0)
    assert stem[:, 0].min() == pytest.approx(max(10.0 * np.tan(np.radians(degrees)), 0.0))


def test_a_taper_of_nothing_is_the_flat_hand_itself_and_none_holds_a_bore() -> None:
    assert tapered(THREE, 0.0) is THREE
    cylinder = Cylinder(
        center_C=np.zeros(3), axis_C=np.array([0.0, 0.0, 1.0]), radius_mm=9.0, height_mm=9.0, internal=True,
        arc_rad=6.0, rms_mm=0.0, surface_filled=True,
    )  # fmt: skip
    for grip, degrees in ((INTERNAL, 5.0), (EXTERNAL, 45.0), (EXTERNAL, float("nan"))):
        with pytest.raises(ValueError, match="tapered tips hold from outside, at less than 45°"):
            GripRequirement(
                gripper_type=CENTRIC_3, opening_width_mm=18.0, grip=grip, approach_C=np.eye(3)[2:], grip_axes_C=np.zeros((0, 3)),
                primitive=cylinder, taper_rad=float(np.radians(degrees)),
            )  # fmt: skip


@pytest.mark.parametrize("degrees", [-15.0, -4.0, 4.0, 15.0])
@pytest.mark.parametrize("depth_mm", [3.25, 8.0])
@pytest.mark.parametrize(("flat", "solid"), [(THREE, cone), (TWO, pyramid), (FOUR, pyramid)])
def test_tips_of_its_own_taper_touch_a_flank_along_as_much_as_they_reach_over_it(
    flat: HandModel, solid: Any, depth_mm: float, degrees: float
) -> None:
    surface, hand = Surface(solid(abs(degrees))), tapered(flat, np.radians(degrees))
    planned = grasp_of(degrees, depth_mm, flat.gripper_type)

    seated = seat(planned, surface, hand)
    assert isinstance(seated, Grasp)
    found = contacts(seated, surface, hand, 30.0, 3.0)

    assert not isinstance(found, Rejection)
    assert seated.opening_width_mm == pytest.approx(planned.opening_width_mm, abs=0.02)
    for contact in found:
        assert contact.height_mm == pytest.approx(depth_mm, abs=0.05)
        assert contact.normal_C[2] == pytest.approx(np.sin(np.radians(abs(degrees))))  # flanks face up, away from the foot


@pytest.mark.parametrize("off_degrees", [-0.5, 0.5])
def test_a_taper_that_is_a_little_off_touches_along_what_the_gap_of_a_touch_allows(off_degrees: float) -> None:
    surface, taper_degrees = Surface(cone(12.0)), -12.0 + off_degrees
    hand = tapered(THREE, np.radians(taper_degrees))

    seated = seat(grasp_of(-12.0, 9.0, taper_degrees=taper_degrees), surface, hand)
    assert isinstance(seated, Grasp)
    found = contacts(seated, surface, hand, 30.0, 3.0)

    assert not isinstance(found, Rejection)
    within = 0.045 / np.tan(np.radians(0.5)) * np.cos(np.radians(12.0))  # the gap grows along the flank
    assert [contact.height_mm for contact in found] == pytest.approx([within] * 3, rel=0.03)


def test_a_taper_that_is_off_by_more_than_a_touch_allows_is_no_contact() -> None:
    surface, hand = Surface(cone(12.0)), tapered(THREE, np.radians(-13.0))

    seated = seat(grasp_of(-12.0, 9.0, taper_degrees=-13.0), surface, hand)

    assert isinstance(seated, Grasp)
    assert isinstance(contacts(seated, surface, hand, 30.0, 3.0), Rejection)


def inclined(degrees: float) -> tuple[Grasp, list[Contact]]:
    """Two flanks, 40 apart, against tips of this taper; component frame = gripper frame, its z the way of the tips."""
    tilt = np.radians(degrees)
    touching = [
        Contact(
            height_mm=8.0, area_mm2=80.0, centre_C=np.array([side * 20.0, 0.0, 0.0]),
            normal_C=np.array([side * np.cos(tilt), 0.0, np.sin(tilt)]), gap_mm=0.0,
        )
        for side in (1.0, -1.0)
    ]  # fmt: skip
    grasp = Grasp(X_CG=np.eye(4), gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=40.0, taper_rad=float(tilt))
    return grasp, touching


@pytest.mark.parametrize("degrees", [-8.0, 8.0])
@pytest.mark.parametrize("up", [True, False])
def test_inclined_pads_hold_a_load_along_the_axis_as_a_wedge_does(degrees: float, up: bool) -> None:
    """Along the flanks each pad rubs with μN. With the grip force F = 2 (N cos τ ± μN sin τ) towards the axis, a load against the
    squeeze takes F = P (1 + μ tan τ) / (μ − tan τ) before it slips out further, one along it P (1 − μ tan τ) / (μ + tan τ)."""
    grasp, touching = inclined(degrees)
    motion, friction, tan = np.tile(np.eye(4), (2, 1, 1)), 0.3, np.tan(np.radians(abs(degrees)))
    motion[0, 2, 3] = -50.0 if up else 50.0
    load = operation_load(motion, np.eye(4), np.zeros(3), 0.0, 30.0)  # of the seat, against the motion

    needed = hold(grasp, touching, np.inf, load, friction).required_force_N

    pushed_up, squeezed_up = not up, degrees < 0.0  # a normal force acts against the flank's normal
    helps = pushed_up != squeezed_up
    expected = (1.0 - friction * tan) / (friction + tan) if helps else (1.0 + friction * tan) / (friction - tan)
    assert needed == pytest.approx(30.0 * expected, rel=1e-6)


@pytest.mark.parametrize(("friction", "held"), [(0.20, False), (0.22, True)])
@pytest.mark.parametrize("degrees", [-12.0, 12.0])
def test_what_is_steeper_than_friction_slips_out_of_tips_whichever_way_they_are_tapered(
    degrees: float, friction: float, held: bool
) -> None:
    """tan 12° = 0.2126."""
    grasp, touching = inclined(degrees)
    down = np.tile(np.eye(4), (2, 1, 1))
    down[0, 2, 3] = 50.0

    found = hold(grasp, touching, np.inf, operation_load(down, np.eye(4), np.zeros(3), 0.1, 5.0), friction)

    assert bool(np.isfinite(found.required_force_N)) is held


def gripper_and_scene(degrees: float, depth_mm: float = 6.0) -> tuple[Gripper, Handle, Any, Mesh]:
    """A cone of 8° that three tapered tips hold as it is moved on its own."""
    solid = cone(8.0)
    body = Body(component=Component(id="cone", mesh=solid, X_PC=np.eye(4)), solid=solid)
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[0, 2, 3] = 5.0
    operation = Operation(id="op-1", active=("cone",), passive=(), motion=motion, force_N=5.0)
    scene = operation_scene(operation, body, [], [], [], 0.1, 1.0)
    hand = tapered(THREE, np.radians(degrees))
    grasp = seat(grasp_of(degrees, depth_mm), Surface(solid), hand)
    assert isinstance(grasp, Grasp)
    width, leaving = grasp.opening_width_mm, Taper(angle_rad=float(np.radians(degrees))).leaving_mm
    handle = Handle(
        operation="op-1", component="cone", segment=0, opening_width_mm=width, release_opening_mm=width + 1.0 + leaving,
        grasp=grasp, gap_mm=1.0, hold=Hold(required_force_N=20.0, moment_Nmm=0.0, symmetry=1.0), safety_factor=2.0,
    )  # fmt: skip
    gripper = Gripper(
        id="G1", gripper_type=CENTRIC_3, fingers=3, grip=EXTERNAL, opening_min_mm=width - 5.0, opening_max_mm=width + 8.0,
        finger_length_mm=35.0, actuator=ACTUATOR, jaw_offset_mm=(width + 8.0 - 30.0) / 2.0, envelope_mm=45.0,
        taper_rad=float(np.radians(degrees)), handles=(handle,),
    )  # fmt: skip
    return gripper, handle, scene, solid


@pytest.mark.parametrize("degrees", [-8.0, 8.0])
def test_the_cad_of_tapered_fingers_keeps_every_promise_from_either_end(degrees: float) -> None:
    gripper, handle, scene, solid = gripper_and_scene(degrees)
    hand = hand_of(gripper, THREE)

    cad = design_gripper_cad(gripper, DESIGNER, hand, [], 60.0, 50.0, 20.0, 2.0, RunContext())
    assert isinstance(cad, GripperCad)

    report = verify_handle(gripper, handle, cad.finger.mesh, cad.body, hand, scene, solid, RunContext())
    assert report.faults == ()
    assert cad.finger.properties["taper_degrees"] == pytest.approx(degrees)


def test_tips_that_reach_below_a_wide_end_open_past_it_to_let_go() -> None:
    gripper, handle, scene, _ = gripper_and_scene(8.0)
    hand, flat = hand_of(gripper, THREE), replace(handle, release_opening_mm=handle.opening_width_mm + 1.0)
    check = HandCheck(scene, hand)
    cad = design_gripper_cad(gripper, DESIGNER, hand, [], 60.0, 50.0, 20.0, 2.0, RunContext())
    assert isinstance(cad, GripperCad)

    assert check.seated(handle.grasp, 35.0) is None
    past = handle.opening_width_mm + 2.0 * 6.0 * np.tan(np.radians(8.0))  # as wide as the end that they pass
    assert handle.release_opening_mm > past > flat.release_opening_mm
    deeper = gripper_and_scene(8.0, depth_mm=14.0)[1].grasp  # 4 mm of the end stand before the stems
    miss = check.seated(deeper, 35.0)
    assert miss is not None
    assert miss.code == "collision"


class ForgetsTheTaper(StraightFinger):
    """Makes straight fingers, whatever is asked for."""

    def design(self, spec: FingerSpec, ctx: RunContext) -> FingerDesign | Rejection:
        return super().design(replace(spec, taper_rad=0.0), ctx)


class MakesNone(StraightFinger):
    """Says that it makes no tapered tips."""

    def tapers(self, taper_rad: float) -> bool:
        return False


@pytest.mark.parametrize(
    ("designer", "why"),
    [
        (ForgetsTheTaper(StraightFingerParams()), "the gripping surface is inclined by -8.0° over 0 % of the tip"),
        (MakesNone(StraightFingerParams()), "the finger designer 'straight' makes no tips of that taper"),
    ],
)
def test_a_finger_without_the_taper_that_was_asked_for_is_refused(designer: FingerDesigner, why: str) -> None:
    gripper, *_ = gripper_and_scene(-8.0)

    answer = design_gripper_cad(gripper, designer, hand_of(gripper, THREE), [], 60.0, 50.0, 20.0, 2.0, RunContext())

    assert isinstance(answer, Rejection)
    assert answer.code == "finger-not-tapered"
    assert why in answer.detail


def test_a_tapered_finger_carries_its_pad_on_the_inclined_face_alone() -> None:
    gripper, *_ = gripper_and_scene(8.0)
    cad = design_gripper_cad(gripper, DESIGNER, hand_of(gripper, THREE), [], 60.0, 50.0, 20.0, 2.0, RunContext())
    assert isinstance(cad, GripperCad)
    assert cad.finger.bonded is not None
    pad, taper = cad.finger.bonded.pad, Taper(angle_rad=float(np.radians(8.0)))

    thickness = transform(inverse(taper.X_FP), pad.mesh.vertices_mm)[:, 0]
    assert [thickness.min(), thickness.max()] == pytest.approx([0.0, 1.0], abs=1e-6)
    assert cad.finger.bonded.pad_size_mm == pytest.approx((1.0, 10.0, 10.0 / np.cos(np.radians(8.0))))
    assert face_areas_mm2(pad.mesh).sum() == pytest.approx(_parallelepiped_mm2(taper), rel=1e-6)


def _parallelepiped_mm2(taper: Taper) -> float:
    """Surface of a strip 1 thick and 10 wide, cut level at both ends."""
    along, level = taper.slant_mm, 1.0 / np.cos(taper.angle_rad)
    return float(2.0 * (along * 10.0 + level * 10.0 + level * taper.height_mm))
