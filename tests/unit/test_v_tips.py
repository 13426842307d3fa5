"""V tips: their geometry, what they touch, and the fingers that are made with them, against closed forms."""

from dataclasses import replace
from typing import Any

import manifold3d
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gripwright.design.actuation import classes_of, costs_of
from gripwright.design.contact import Surface, contact_heights_mm, contacts, forbidden_touch, seat, standing_off_mm
from gripwright.design.core_hand import core_hand
from gripwright.design.grooved_hand import hand_of
from gripwright.design.hand_check import HandCheck
from gripwright.design.reason import held_with
from gripwright.design.scenes import Body, operation_scene
from gripwright.design.stages.fingers import GripperCad, design_gripper_cad
from gripwright.design.stages.verify import verify_handle
from gripwright.design.tapered_hand import tapered
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component, Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, INTERNAL, PARALLEL_2, FreeGrasp, Grasp, GripRequirement, Hold
from gripwright.domain.gripper import Actuator, FingerDesign, FingerSpec, Gripper, Handle
from gripwright.domain.shape import Cylinder, FloatArray, Mesh
from gripwright.domain.v_tip import SIDES, Vee, VTip, tip_words
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.measures import face_areas_mm2, face_normals, volume_mm3
from gripwright.plugin_api import FingerDesigner, RunContext
from gripwright_builtin.fingers.straight import StraightFinger, StraightFingerParams
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from mesh_factory import mesh_of

FLAT, DESIGNER = ParallelHand(HandSettings()), StraightFinger(StraightFingerParams())
RADIUS_MM, HEIGHT_MM = 8.0, 24.0
VEE = Vee(angle_rad=float(np.radians(120.0)), depth_mm=3.0)
ACTUATOR = Actuator(
    maker="Maker", model="M1", gripper_type=PARALLEL_2, stroke_mm=12.0, opening_max_mm=30.0, grip_force_N=100.0,
    body_diameter_mm=60.0, body_length_mm=50.0,
)  # fmt: skip


def cone(degrees: float, sections: int = 192) -> Mesh:
    """A frustum of a cone, or a cylinder, whose foot of radius 8 stands at z = 0; 24 high."""
    top = RADIUS_MM - HEIGHT_MM * np.tan(np.radians(degrees))
    return mesh_of(manifold3d.Manifold.cylinder(HEIGHT_MM, RADIUS_MM, top, sections))


def grasp_of(degrees: float, depth_mm: float, off_mm: tuple[float, float] = (0.0, 0.0), vee: Vee = VEE) -> Grasp:
    """From above, tips `depth_mm` below the narrow end (a negative angle, and 0), or from below, as far above the foot."""
    tip = VTip(vee=vee, taper_rad=float(np.radians(degrees)))
    above, slope = degrees <= 0.0, np.tan(np.radians(abs(degrees)))
    z = HEIGHT_MM - depth_mm if above else depth_mm
    X = np.diag([1.0, -1.0, -1.0, 1.0]) if above else np.eye(4)
    X[:3, 3] = *off_mm, z
    return Grasp(
        X_CG=X,
        gripper_type=PARALLEL_2,
        grip=EXTERNAL,
        opening_width_mm=vee.opening_mm(RADIUS_MM - z * slope) - 2.0 * tip.tip_mm,
        taper_rad=tip.taper_rad,
        vee=vee,
    )


@pytest.mark.parametrize("degrees", [-12.0, 0.0, 12.0])
@pytest.mark.parametrize("angle", [90.0, 120.0, 150.0])
def test_a_cone_of_the_taper_touches_each_flank_along_a_line_of_its_frame(angle: float, degrees: float) -> None:
    tip = VTip(vee=Vee(angle_rad=float(np.radians(angle)), depth_mm=4.0), taper_rad=float(np.radians(degrees)))
    at = np.linspace(0.0, -tip.height_mm, 5)
    radii = 5.0 - at * np.tan(tip.taper_rad)  # narrower where the tips converge
    axis_x = tip.section_mm(0.0)[1, 0] - radii[0] / np.cos(tip.vee.turn_rad)

    for side in SIDES:
        around = np.linspace(0.0, 2.0 * np.pi, 721)
        rim = np.stack(
            [axis_x + np.outer(radii, np.cos(around)), np.outer(radii, np.sin(around)), np.outer(at, np.ones(721))], -1
        )
        off = transform(inverse(tip.X_FP(side)), rim)  # (z, angle, 3)

        assert off[..., 0].max(axis=1) == pytest.approx(np.zeros(5), abs=1e-3)
        touch = off[np.arange(5), off[..., 0].argmax(axis=1)]
        assert np.ptp(touch[:, 1]) == pytest.approx(0.0, abs=0.05)  # along z of the frame
        assert touch[[0, -1], 2] == pytest.approx([0.0, -tip.slant_mm], abs=0.05)


@pytest.mark.parametrize("degrees", [-10.0, 0.0, 10.0])
def test_a_finger_with_a_v_is_two_halves_before_a_stem_as_thick_as_a_flat_one(degrees: float) -> None:
    tip = VTip(vee=VEE, taper_rad=float(np.radians(degrees)))
    *halves, stem = (solid.vertices_mm for solid in tapered(FLAT, tip.taper_rad, VEE).finger(30.0, EXTERNAL))

    for side, half in zip(SIDES, halves, strict=True):
        flank = transform(inverse(tip.X_FP(side)), half)[:, 0]
        assert (flank.min(), (np.abs(flank) < 1e-9).sum()) == (pytest.approx(0.0, abs=1e-9), 4)
        assert (side * half[:, 1]).min() == 0.0
        assert (side * half[:, 1]).max() == pytest.approx(3.0 * np.tan(np.radians(60.0)))
    assert min(half[:, 0].min() for half in halves) == pytest.approx(0.0, abs=1e-12)
    rise = 10.0 * np.tan(np.radians(abs(degrees))) / np.cos(np.radians(30.0))
    assert stem[:, 0].max() == halves[0][:, 0].max() == pytest.approx(8.0 + 3.0 + rise)
    assert stem[:, 0].min() == pytest.approx(3.0 + max(rise * np.sign(degrees), 0.0))
    assert (halves[0][:, 2].min(), stem[:, 2].max(), stem[:, 2].min()) == (-10.0, -10.0, -30.0)


@pytest.mark.parametrize("degrees", [-10.0, 0.0, 10.0])
def test_the_way_back_of_a_finger_with_a_v_holds_all_that_its_solids_pass_through(degrees: float) -> None:
    hand: Any = tapered(FLAT, float(np.radians(degrees)), VEE)
    rng, spread = np.random.default_rng(0), np.random.default_rng(1).dirichlet(np.ones(8), size=200)
    passed = np.concatenate([spread @ solid.vertices_mm for solid in hand.finger(30.0, EXTERNAL)])
    passed[:, 2] -= rng.uniform(0.0, 60.0, len(passed))

    def within(points: FloatArray, corners: FloatArray) -> FloatArray:
        planes = ConvexHull(corners).equations
        return (points @ planes[:, :3].T + planes[:, 3]).max(axis=1)

    outside = np.min([within(passed, solid.vertices_mm) for solid in hand.way_out(200.0, EXTERNAL)], axis=0)
    assert outside.max() <= 1e-9


def test_v_tips_are_of_parallel_grippers_that_hold_from_outside() -> None:
    fit = Cylinder(
        center_C=np.zeros(3), axis_C=np.array([0.0, 0.0, 1.0]), radius_mm=9.0, height_mm=9.0, internal=False,
        arc_rad=6.0, rms_mm=0.0, surface_filled=True,
    )  # fmt: skip
    for gripper_type, grip in ((CENTRIC_3, EXTERNAL), (PARALLEL_2, INTERNAL)):
        with pytest.raises(ValueError, match="V tips are of parallel-2 and hold from outside"):
            GripRequirement(
                gripper_type=gripper_type, opening_width_mm=18.0, grip=grip, approach_C=np.eye(3)[2:],
                grip_axes_C=np.zeros((0, 3)), primitive=fit, vee=VEE,
            )  # fmt: skip
    for angle, depth in ((59.0, 3.0), (180.0, 3.0), (120.0, 0.0)):
        with pytest.raises(ValueError, match="a V opens by 60° to less than 180° and has a depth"):
            Vee(angle_rad=float(np.radians(angle)), depth_mm=depth)


@pytest.mark.parametrize("degrees", [-12.0, -4.0, 0.0, 4.0, 12.0])
@pytest.mark.parametrize("depth_mm", [3.25, 8.0])
def test_both_flanks_of_both_fingers_touch_along_as_much_as_they_reach_over_it(depth_mm: float, degrees: float) -> None:
    surface, hand = Surface(cone(abs(degrees))), tapered(FLAT, float(np.radians(degrees)), VEE)
    planned = grasp_of(degrees, depth_mm)

    seated = seat(planned, surface, hand)
    assert isinstance(seated, Grasp)
    found = contacts(seated, surface, hand, 30.0, 3.0)

    assert not isinstance(found, Rejection)
    assert seated.opening_width_mm == pytest.approx(planned.opening_width_mm, abs=0.02)
    assert len(found) == 4
    radial = {tuple(np.round(contact.normal_C[:2] / np.cos(np.radians(degrees)), 3).tolist()) for contact in found}
    assert radial == {(x, y) for x in (-0.866, 0.866) for y in (-0.5, 0.5)}
    for contact in found:
        assert contact.height_mm == pytest.approx(depth_mm, abs=0.05)
        assert contact.normal_C[2] == pytest.approx(np.sin(np.radians(abs(degrees))))
        assert contact.closing_C is not None
        assert contact.closing_C @ contact.normal_C < -0.8
    assert contact_heights_mm(seated, surface, hand, 30.0) == pytest.approx([depth_mm] * 2, abs=0.05)


@pytest.mark.parametrize("off_mm", [(0.2, 0.0), (0.0, 0.3), (-0.15, 0.25)])
@pytest.mark.parametrize("degrees", [-8.0, 0.0, 8.0])
def test_a_v_centres_what_it_holds_along_and_across_the_fingers(degrees: float, off_mm: tuple[float, float]) -> None:
    surface, hand = Surface(cone(abs(degrees))), tapered(FLAT, float(np.radians(degrees)), VEE)

    seated = seat(grasp_of(degrees, 8.0, off_mm), surface, hand)

    assert isinstance(seated, Grasp)
    assert seated.X_CG[:2, 3] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert seated.opening_width_mm == pytest.approx(grasp_of(degrees, 8.0).opening_width_mm, abs=0.02)
    assert standing_off_mm(grasp_of(degrees, 8.0, off_mm), surface, hand) == pytest.approx([0.0, 0.0], abs=1e-3)


def test_a_square_bar_touches_a_v_of_a_right_angle_and_no_other() -> None:
    bar = Surface(mesh_of(manifold3d.Manifold.cube([10.0, 10.0, HEIGHT_MM], True).rotate([0.0, 0.0, 45.0])))
    right, wide = (Vee(angle_rad=float(np.radians(angle)), depth_mm=4.0) for angle in (90.0, 120.0))
    X = np.eye(4)
    X[2, 3] = 8.0 - HEIGHT_MM / 2.0
    corner = np.sqrt(50.0)

    found = {}
    for vee in (right, wide):
        grasp = Grasp(X_CG=X, gripper_type=PARALLEL_2, grip=EXTERNAL, opening_width_mm=2.0 * (corner - vee.depth_mm), vee=vee)
        seated = seat(grasp, bar, tapered(FLAT, 0.0, vee))
        assert isinstance(seated, Grasp)
        found[vee] = contacts(seated, bar, tapered(FLAT, 0.0, vee), 30.0, 3.0)

    assert isinstance(found[right], tuple)
    assert found[wide] == Rejection(
        "no-contact", "a flank of finger 1 touches along 0.00 mm of parallel surface, at least 3.00 mm"
    )


def test_what_lies_on_the_edges_of_a_v_is_no_contact_and_one_flank_alone_is_none() -> None:
    small = Vee(angle_rad=VEE.angle_rad, depth_mm=1.5)  # 5.2 wide, a circle of 8 touches at 4.0 aside
    whole, hand = Surface(cone(0.0)), tapered(FLAT, 0.0, small)
    edges = 2.0 * np.sqrt(RADIUS_MM**2 - (small.width_mm / 2.0) ** 2)
    flattened = Surface(mesh_of(_cylinder_without(np.array([1.0, 1.0]))))

    seated = seat(replace(grasp_of(0.0, 8.0, vee=small), opening_width_mm=edges), whole, hand)
    assert isinstance(seated, Grasp)
    refused = contacts(seated, whole, hand, 30.0, 3.0)

    assert isinstance(refused, Rejection)
    assert refused.detail.startswith("a flank of finger 1 touches along 0.00 mm")
    once = seat(grasp_of(0.0, 8.0), flattened, tapered(FLAT, 0.0, VEE))
    assert isinstance(once, Rejection)
    assert once.code == "no-contact"


def _cylinder_without(towards: FloatArray) -> manifold3d.Manifold:
    """Half a millimetre and more is milled off on the side where one flank would touch."""
    cylinder = manifold3d.Manifold.cylinder(HEIGHT_MM, RADIUS_MM, RADIUS_MM, 192)
    turn = np.radians(30.0)
    normal = [np.cos(turn) * towards[0], np.sin(turn) * towards[1], 0.0]
    return cylinder.trim_by_plane([-float(x) for x in normal], -(RADIUS_MM - 1.0))


def test_what_lies_in_the_hollow_of_a_v_is_not_touched() -> None:
    solid = cone(0.0)
    surface, hand = Surface(solid), tapered(FLAT, 0.0, VEE)
    seated = seat(grasp_of(0.0, 8.0), surface, hand)
    assert isinstance(seated, Grasp)
    aside = np.abs(face_normals(solid)[:, 1])

    def touched(faces: FloatArray) -> Rejection | None:
        region = Forbidden(reason="a mark", detector="marked", faces=faces)
        chosen = Mesh(vertices_mm=solid.vertices_mm, faces=solid.faces[faces])
        return forbidden_touch(seated, [(region, Surface(chosen))], hand, 12.0)

    side = np.abs(face_normals(solid)[:, 2]) < 0.5
    assert touched(side & (aside < 0.3)) is None  # between the flanks, 0.1 mm and more off them
    assert touched(side & (aside > 0.45) & (aside < 0.55)) is not None


def gripper_and_scene(degrees: float, depth_mm: float = 6.0) -> tuple[Gripper, Handle, Any, Mesh]:
    """A cone or a cylinder that two V tips hold as it is moved on its own."""
    solid = cone(abs(degrees))
    body = Body(component=Component(id="cone", mesh=solid, X_PC=np.eye(4)), solid=solid)
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[0, 2, 3] = 5.0
    operation = Operation(id="op-1", active=("cone",), passive=(), motion=motion, force_N=5.0)
    scene = operation_scene(operation, body, [], [], [], 0.1, 1.0)
    tip = VTip(vee=VEE, taper_rad=float(np.radians(degrees)))
    grasp = seat(grasp_of(degrees, depth_mm), Surface(solid), tapered(FLAT, tip.taper_rad, VEE))
    assert isinstance(grasp, Grasp)
    width = grasp.opening_width_mm
    handle = Handle(
        operation="op-1", component="cone", segment=0, opening_width_mm=width, release_opening_mm=width + 1.0 + tip.leaving_mm,
        grasp=grasp, gap_mm=1.0, hold=Hold(required_force_N=20.0, moment_Nmm=0.0, symmetry=1.0), safety_factor=2.0,
    )  # fmt: skip
    gripper = Gripper(
        id="G1", gripper_type=PARALLEL_2, fingers=2, grip=EXTERNAL, opening_min_mm=width - 2.0, opening_max_mm=width + 8.0,
        finger_length_mm=35.0, actuator=ACTUATOR, jaw_offset_mm=(width + 8.0 - 30.0) / 2.0, envelope_mm=45.0,
        taper_rad=tip.taper_rad, vee=VEE, handles=(handle,),
    )  # fmt: skip
    return gripper, handle, scene, solid


def made(gripper: Gripper, designer: FingerDesigner = DESIGNER) -> GripperCad | Rejection:
    return design_gripper_cad(gripper, designer, hand_of(gripper, FLAT), [], 60.0, 50.0, 20.0, 2.0, RunContext())


@pytest.mark.parametrize("degrees", [-8.0, 0.0, 8.0])
def test_the_cad_of_fingers_with_a_v_keeps_every_promise(degrees: float) -> None:
    gripper, handle, scene, solid = gripper_and_scene(degrees)
    cad = made(gripper)
    assert isinstance(cad, GripperCad)

    report = verify_handle(gripper, handle, cad.finger.mesh, cad.body, hand_of(gripper, FLAT), scene, solid, RunContext())

    assert report.faults == ()
    assert cad.finger.properties["v_angle_degrees"] == pytest.approx(120.0)
    assert cad.finger.properties["v_depth_mm"] == 3.0
    assert cad.finger.properties.get("taper_degrees", 0.0) == pytest.approx(degrees)
    assert cad.finger.properties["wall_min_mm"] >= 1.2 - 1e-6


def test_v_tips_that_reach_below_a_wide_end_open_past_it_to_let_go() -> None:
    gripper, handle, scene, _ = gripper_and_scene(8.0)
    check = HandCheck(scene, hand_of(gripper, FLAT))

    assert check.seated(handle.grasp, 35.0) is None
    past = handle.opening_width_mm + 2.0 * 6.0 * np.tan(np.radians(8.0)) / np.cos(VEE.turn_rad)
    assert handle.release_opening_mm > past > handle.opening_width_mm + 1.0


@pytest.mark.parametrize("degrees", [-8.0, 0.0, 8.0])
def test_the_pad_of_a_v_is_a_strip_of_even_thickness_on_both_flanks(degrees: float) -> None:
    gripper, *_ = gripper_and_scene(degrees)
    cad = made(gripper)
    assert isinstance(cad, GripperCad)
    assert cad.finger.bonded is not None
    pad, tip = cad.finger.bonded.pad.mesh, VTip(vee=VEE, taper_rad=gripper.taper_rad)

    for side in SIDES:
        beside = pad.triangles_mm[(side * pad.triangles_mm[..., 1] > -1e-6).all(axis=1)]
        off = transform(inverse(tip.X_FP(side)), beside)[..., 0]
        assert (off.min(), off.max()) == (pytest.approx(0.0, abs=1e-6), pytest.approx(1.0, abs=1e-6))
    assert cad.finger.bonded.pad_size_mm == pytest.approx((1.0, 12.0, 10.0 / np.cos(np.radians(degrees))))
    assert volume_mm3(pad) == pytest.approx(2.0 * tip.flank_mm2 * 1.0, rel=1e-6)
    whole = face_areas_mm2(cad.finger.mesh)
    assert whole[np.abs(transform(inverse(tip.X_FP(1.0)), cad.finger.mesh.triangles_mm)[..., 0]).max(axis=1) < 1e-6].sum() == (
        pytest.approx(tip.flank_mm2, rel=1e-6)
    )


class ForgetsTheV(StraightFinger):
    """Makes flat fingers, whatever is asked for."""

    def design(self, spec: FingerSpec, ctx: RunContext) -> FingerDesign | Rejection:
        return super().design(replace(spec, vee=None), ctx)


class FlattensTheV(StraightFinger):
    """Makes a V that is a little flatter."""

    def design(self, spec: FingerSpec, ctx: RunContext) -> FingerDesign | Rejection:
        assert spec.vee is not None
        return super().design(replace(spec, vee=Vee(angle_rad=spec.vee.angle_rad + 0.02, depth_mm=2.9)), ctx)


class MakesNone(StraightFinger):
    """Says that it makes no V tips."""

    def has_v(self, vee: Vee, taper_rad: float) -> bool:
        return False


@pytest.mark.parametrize(
    ("designer", "why"),
    [
        (ForgetsTheV(StraightFingerParams()), "a flank of the V of 120.0° is there over 0 % of the tip, at least 95 %"),
        (FlattensTheV(StraightFingerParams()), "a flank of the V of 120.0° is there over 0 % of the tip, at least 95 %"),
        (MakesNone(StraightFingerParams()), "the finger designer 'straight' makes no tips with that V"),
    ],
)
def test_a_finger_without_the_v_that_was_asked_for_is_refused(designer: FingerDesigner, why: str) -> None:
    answer = made(gripper_and_scene(0.0)[0], designer)

    assert isinstance(answer, Rejection)
    assert answer.code == "finger-without-v"
    assert why in answer.detail


def free(grasp: Grasp) -> FreeGrasp:
    return FreeGrasp(
        grasp=grasp, envelopes_mm=np.array([40.0, 50.0]), finger_length_min_mm=np.array([10.0, 10.0]),
        finger_length_max_mm=np.inf, release_opening_mm=grasp.opening_width_mm + 1.0, gap_mm=1.0,
        hold=Hold(required_force_N=20.0, moment_Nmm=0.0, symmetry=1.0),
    )  # fmt: skip


def test_a_class_of_grippers_serves_grasps_of_its_own_v_and_taper_alone_and_opens_within_its_palm() -> None:
    policy: Any = type("P", (), {"enforced": False})
    costs, grasps = costs_of([ACTUATOR], policy, {}), [free(grasp_of(0.0, 8.0))]
    flat, v = (classes_of([ACTUATOR], costs, grasps, tapered(FLAT, 0.0, vee), EXTERNAL)[0] for vee in (None, VEE))

    assert v.key != flat.key
    assert v.opening_max_mm == flat.opening_max_mm - 2.0 * VEE.depth_mm
    other = Vee(angle_rad=VEE.angle_rad, depth_mm=4.0)
    asked = [grasp_of(0.0, 8.0), grasp_of(0.0, 8.0, vee=other), grasp_of(-8.0, 8.0), replace(grasp_of(0.0, 8.0), vee=None)]
    assert [v.serves(free(grasp)) for grasp in asked] == [True, False, False, False]
    assert [flat.serves(free(grasp)) for grasp in asked] == [False, False, False, True]


def test_a_reason_names_the_tips_and_not_a_diameter() -> None:
    assert held_with(grasp_of(0.0, 8.0), 2) == "gripped by V tips 12.5 mm apart (segment 2),"


def test_a_v_is_named_with_its_taper_and_neighbouring_grasps_are_not_narrowed_by_a_core() -> None:
    assert tip_words(0.0, None) == ""
    assert tip_words(0.0, VEE) == "V of 120.0°, 3 mm deep"
    assert tip_words(float(np.radians(-8.0)), VEE) == "V of 120.0°, 3 mm deep, tapered 8.0° towards the palm"
    assert core_hand(tapered(FLAT, 0.0, VEE), EXTERNAL, 10.0, np.zeros(4)) is None
