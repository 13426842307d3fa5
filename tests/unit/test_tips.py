"""Concave tips: their geometry against closed forms, and that they are kept only where every promise is."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest

from gripwright.design.contact import contacts, seat
from gripwright.design.gripping_surface import gripping_surface
from gripwright.design.grooved_hand import GroovedHand
from gripwright.design.hand_check import HandCheck
from gripwright.design.handles import safety_factor
from gripwright.design.holding import contact_radius_mm, hold
from gripwright.design.holding_load import operation_load
from gripwright.design.scenes import Body, held_component, operation_scene
from gripwright.design.tips import HandleScene, with_shaped_tips
from gripwright.domain.assembly import Component, Obstacle, Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, Grasp, Hold
from gripwright.domain.gripper import Actuator, FingerDesign, FingerSpec, Gripper, Handle
from gripwright.domain.groove import Groove
from gripwright.domain.pad import PAD
from gripwright.domain.shape import Cylinder, Mesh
from gripwright.geometry import brep
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api import FingerDesigner, RunContext
from gripwright_builtin.fingers.concave import ConcaveFinger, ConcaveFingerParams
from gripwright_builtin.fingers.straight import StraightFinger, StraightFingerParams
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from mesh_factory import mesh_of

HAND = CentricHand(CentricSettings())
CONCAVE = ConcaveFinger(ConcaveFingerParams())
RADIUS_MM, HEIGHT_MM, SECTIONS = 20.0, 15.0, 192
ACTUATOR = Actuator(
    maker="Maker", model="M1", gripper_type=CENTRIC_3, stroke_mm=8.0, opening_max_mm=30.0, grip_force_N=200.0,
    body_diameter_mm=60.0, body_length_mm=50.0,
)  # fmt: skip


def disc(radius_mm: float = RADIUS_MM) -> Mesh:
    return mesh_of(manifold3d.Manifold.cylinder(HEIGHT_MM, radius_mm, radius_mm, SECTIONS))


def cylinder(radius_mm: float = RADIUS_MM, internal: bool = False) -> Cylinder:
    return Cylinder(
        center_C=np.array([0.0, 0.0, HEIGHT_MM / 2.0]), axis_C=np.array([0.0, 0.0, 1.0]), radius_mm=radius_mm,
        height_mm=HEIGHT_MM, internal=internal, arc_rad=2.0 * np.pi, rms_mm=0.0, surface_filled=True,
    )  # fmt: skip


def held_from_above(post: Mesh | None = None, radius_mm: float = RADIUS_MM) -> tuple[Gripper, HandleScene]:
    """A disc that three flat fingers hold from above as it is set down; a post may stand beside it."""
    body = Body(component=Component(id="disc", mesh=disc(radius_mm), X_PC=np.eye(4)), solid=disc(radius_mm))
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[0, 2, 3] = 0.5
    operation = Operation(id="op-1", active=("disc",), passive=(), motion=motion, force_N=5.0)
    posts = [] if post is None else [Obstacle(id="post", mesh=post, X_PE=np.eye(4))]
    scene = operation_scene(operation, body, [], [], posts, 0.1, 1.0)
    held = held_component(operation, body, [], body.solid, ())
    X_CG = np.diag([1.0, -1.0, -1.0, 1.0])
    X_CG[2, 3] = 5.0
    planned = Grasp(X_CG=X_CG, gripper_type=CENTRIC_3, grip=EXTERNAL, opening_width_mm=2.0 * radius_mm)
    grasp = seat(planned, Surface(body.solid), HAND)
    assert isinstance(grasp, Grasp)
    handle = Handle(
        operation="op-1", component="disc", segment=0, opening_width_mm=grasp.opening_width_mm,
        release_opening_mm=grasp.opening_width_mm + 1.0, grasp=grasp, gap_mm=1.0,
        hold=Hold(required_force_N=1e3, moment_Nmm=0.0, symmetry=1.0), safety_factor=0.2,
    )  # fmt: skip
    gripper = Gripper(
        id="G1", gripper_type=CENTRIC_3, fingers=3, grip=EXTERNAL, opening_min_mm=2.0 * radius_mm - 5.0,
        opening_max_mm=2.0 * radius_mm + 3.0, finger_length_mm=15.0, actuator=ACTUATOR,
        jaw_offset_mm=(2.0 * radius_mm + 3.0 - 30.0) / 2.0, envelope_mm=45.0, handles=(handle,),
    )  # fmt: skip
    return gripper, HandleScene(held=held, scene=scene, primitive=cylinder(radius_mm))


def shaped(gripper: Gripper, at: HandleScene, designer: FingerDesigner = CONCAVE) -> Gripper:
    return with_shaped_tips(gripper, [at], designer, HAND, (60.0, 50.0), 2.0, RunContext())


@pytest.mark.parametrize("radius_mm", [5.5, 8.0, 20.0, 60.0])
def test_a_groove_passes_through_the_corners_of_the_tip_and_its_chords_keep_to_it(radius_mm: float) -> None:
    groove = Groove(radius_mm=radius_mm, width_mm=10.0)
    chords = groove.chords_mm(0.002)
    middles = (chords[:-1] + chords[1:]) / 2.0

    assert groove.depth_mm == pytest.approx(radius_mm - np.sqrt(radius_mm**2 - 25.0))
    assert chords[[0, -1]].tolist() == [[0.0, -5.0], [0.0, 5.0]]
    assert np.hypot(chords[:, 0] - groove.axis_x_mm, chords[:, 1]) == pytest.approx(np.full(len(chords), radius_mm))
    off = radius_mm - np.hypot(middles[:, 0] - groove.axis_x_mm, middles[:, 1])
    assert 0.0 < off.min() <= off.max() <= 0.002


@pytest.mark.parametrize("radius_mm", [8.0, 20.0, 60.0])
def test_the_gripping_surface_of_a_grooved_hand_is_the_groove(radius_mm: float) -> None:
    groove = Groove(radius_mm=radius_mm, width_mm=10.0)
    surface = gripping_surface(GroovedHand(HAND, groove), EXTERNAL)

    assert surface.y_range == (-5.0, 5.0)
    assert surface.radius_mm == pytest.approx(-radius_mm, rel=2e-3)
    assert surface.profile[:, 1].max() == pytest.approx(groove.depth_mm)
    assert surface.thickness_mm == pytest.approx(8.0 + groove.depth_mm)


@pytest.mark.parametrize("radius_mm", [8.0, 20.0, 60.0])
def test_a_grooved_finger_lies_within_its_hand_and_its_pad_is_a_layer_of_the_groove(radius_mm: float) -> None:
    groove = Groove(radius_mm=radius_mm, width_mm=10.0)
    spec = FingerSpec(
        gripper_type=CENTRIC_3, grip=EXTERNAL, finger_length_mm=25.0, jaw_offset_mm=9.25, opening_min_mm=52.5,
        opening_max_mm=60.5, stroke_mm=8.0, fingers=3, envelope_mm=45.0, actuator=ACTUATOR, contact_radii_mm=(),
        grip_force_N=30.0, groove=groove,
    )  # fmt: skip
    finger = CONCAVE.design(spec, RunContext())
    assert isinstance(finger, FingerDesign)
    assert finger.bonded is not None

    room = sum(
        (manifold3d.Manifold.hull_points(solid.vertices_mm) for solid in GroovedHand(HAND, groove).finger(25.0, EXTERNAL)),
        manifold3d.Manifold(),
    )
    solid = manifold3d.Manifold(manifold3d.Mesh64(finger.mesh.vertices_mm.copy(), finger.mesh.faces.astype(np.uint64)))
    stem = solid.trim_by_plane((0.0, 0.0, 1.0), -24.99)
    assert (stem - room).volume() < 1e-3 * stem.volume()
    inner, outer = ((r**2 * np.arcsin(5.0 / r) + 5.0 * np.sqrt(r**2 - 25.0)) for r in (radius_mm, radius_mm + 1.0))
    ring = outer - inner  # of two discs between the stem's sides
    assert brep.measure(brep.read_brep(finger.bonded.pad.brep)).volume_mm3 == pytest.approx(25.0 * ring, rel=1e-6)
    assert finger.properties["contact_offset_mm"] == groove.depth_mm


def test_relative_curvature_is_that_of_the_cylinder_less_that_of_the_groove_and_no_strip_is_wider_than_the_tip() -> None:
    surface = gripping_surface(GroovedHand(HAND, Groove(radius_mm=20.0, width_mm=10.0)), EXTERNAL)

    assert contact_radius_mm(cylinder(10.0), surface) == pytest.approx(1.0 / (1.0 / 10.0 - 1.0 / 20.0), rel=2e-3)
    widest = contact_radius_mm(cylinder(20.0), surface)
    assert 2.0 * np.sqrt(2.0 * widest * PAD.compression * PAD.thickness_mm) == pytest.approx(10.0)


def test_in_a_groove_all_openings_shift_by_twice_its_depth_and_the_jaws_stay() -> None:
    gripper, at = held_from_above()
    made = shaped(gripper, at)
    (handle,), groove = made.handles, made.groove
    assert groove is not None

    assert groove.radius_mm == pytest.approx(RADIUS_MM + 0.01, abs=2e-3)
    assert handle.grasp.contact_offset_mm == groove.depth_mm
    assert handle.opening_width_mm == pytest.approx(2.0 * (RADIUS_MM - groove.depth_mm), abs=0.02)
    assert handle.release_opening_mm - handle.opening_width_mm == pytest.approx(1.0)
    assert made.opening_max_mm - gripper.opening_max_mm == pytest.approx(2.0 * (made.jaw_offset_mm - gripper.jaw_offset_mm))
    assert handle.safety_factor == safety_factor(ACTUATOR.grip_force_N, handle.hold)


def test_a_groove_holds_a_moment_over_the_wider_strip_of_the_relative_curvature_and_with_less_force() -> None:
    """Half a strip: a = (1.5 F R' / k h)^(1/3), 1/R' = 1/R − 1/R_groove, but no wider than the tip. Three fingers hold moments
    by their distance: the force falls by little, the pressure by a third."""
    gripper, at = held_from_above(radius_mm=18.0)
    (flat,) = gripper.handles
    hand = GroovedHand(HAND, Groove(radius_mm=20.0, width_mm=10.0))
    radius = contact_radius_mm(cylinder(18.0), gripping_surface(hand, EXTERNAL))
    load = operation_load(at.scene.motion, at.scene.X_PC, at.held.centroid_C + np.array([25.0, 0.0, 0.0]), 0.3, 0.0)
    three = contacts(flat.grasp, Surface(at.held.solid), HAND, 15.0, 3.0)
    assert not isinstance(three, Rejection)
    needed = [hold(flat.grasp, three, r, load, 0.2) for r in (18.0, radius)]

    assert needed[1].required_force_N < needed[0].required_force_N
    pressures = [found.required_force_N / found.contact_area_mm2 for found in needed]
    assert pressures[1] / pressures[0] == pytest.approx(np.cbrt(18.0 / 62.5), rel=2e-3)
    for found, relative in zip(needed, (18.0, radius), strict=True):
        half = np.cbrt(1.5 * found.required_force_N / 3.0 * relative / (PAD.normal_N_mm3 * three[0].height_mm))
        half = min(half, np.sqrt(2.0 * relative * PAD.compression * PAD.thickness_mm))
        assert found.contact_area_mm2 == pytest.approx(6.0 * half * three[0].height_mm, rel=1e-3)


def post_in_the_wedge() -> Mesh:
    """It stands clear of the flat fingers, between their plane and the disc, where the flank of a groove would be."""
    return mesh_of(manifold3d.Manifold.cube((0.1, 0.2, 4.0)).translate((19.75, 4.7, 7.0)))


@pytest.mark.parametrize("reason", ["designer", "bore", "obstacle", "force"])
def test_tips_stay_flat_where_shaped_ones_break_a_promise_or_help_nothing(reason: str) -> None:
    gripper, at = held_from_above(post_in_the_wedge() if reason == "obstacle" else None)
    if reason == "bore":
        at = replace(at, primitive=cylinder(internal=True))
    if reason == "force":
        (handle,) = gripper.handles
        gripper = replace(gripper, handles=(replace(handle, hold=replace(handle.hold, required_force_N=1e-3)),))
    designer: FingerDesigner = StraightFinger(StraightFingerParams()) if reason == "designer" else CONCAVE

    assert shaped(gripper, at, designer) is gripper


def test_the_obstacle_that_keeps_tips_flat_leaves_flat_tips_free() -> None:
    gripper, at = held_from_above(post_in_the_wedge())
    (handle,) = gripper.handles

    assert HandCheck(at.scene, HAND).seated(handle.grasp, gripper.finger_length_mm) is None
