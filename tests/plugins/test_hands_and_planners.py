"""Hands stand where INTERFACE says; planned grasps touch what they are planned for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gripwright.design.contact import contacts, seat
from gripwright.domain.assembly import Component
from gripwright.domain.grasp import CENTRIC_4, EXTERNAL, INTERNAL, PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.shape import Box, Cylinder, FloatArray, Segment
from gripwright.geometry.frames import is_rigid
from gripwright.geometry.held_surface import Surface
from gripwright.geometry.measures import face_normals
from gripwright.plugin_api import HandModel, RunContext
from gripwright_builtin.hands.centric import CentricHand, CentricSettings, FourFingerHand
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from gripwright_builtin.planners.axial import AxialPlanner, AxialSettings
from gripwright_builtin.planners.facet_pairs import FacetPairPlanner, FacetPairSettings
from mesh_factory import box_mesh, component_of, moved, turned_mesh

FOUR = FourFingerHand(CentricSettings())
HANDS = [CentricHand(CentricSettings()), FOUR, ParallelHand(HandSettings())]


def turned_pose(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3) * 40
    return X


def whole(component: Component) -> Segment:
    return Segment(id=0, faces=np.arange(len(component.mesh.faces)), area_mm2=1.0, hull_volume_mm3=1.0)


@pytest.mark.parametrize("hand", HANDS)
def test_fingers_stand_evenly_about_the_axis_at_half_the_opening(hand: HandModel) -> None:
    poses = hand.finger_poses(30.0)

    angles = np.arctan2(poses[:, 1, 3], poses[:, 0, 3])
    assert np.linalg.norm(poses[:, :3, 3], axis=1) == pytest.approx(np.full(hand.fingers, 15.0))
    assert np.mod(angles, 2 * np.pi) == pytest.approx(2 * np.pi * np.arange(hand.fingers) / hand.fingers)
    assert poses[:, :3, 0] * 15.0 == pytest.approx(poses[:, :3, 3])  # +x leads away from the axis


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize(("grip", "sign"), [(EXTERNAL, 1.0), (INTERNAL, -1.0)])
def test_a_finger_lies_behind_its_gripping_plane_from_the_tip_to_its_length(hand: HandModel, grip: str, sign: float) -> None:
    corners = np.concatenate([solid.vertices_mm for solid in hand.finger(40.0, grip)])

    assert (sign * corners[:, 0] >= 0.0).all()
    assert (sign * corners[:, 0]).min() == 0.0
    assert (corners[:, 2].min(), corners[:, 2].max()) == (-40.0, 0.0)


@pytest.mark.parametrize("hand", HANDS)
def test_the_palm_holds_everything_within_the_envelope_behind_the_stems(hand: HandModel) -> None:
    corners = np.concatenate([solid.vertices_mm for solid in hand.palm(25.0, 50.0, 100.0)])

    assert corners[:, 2].max() == -25.0
    assert corners[:, 2].min() == -125.0
    middles = (corners[: len(corners) // 2] + np.roll(corners[: len(corners) // 2], 1, axis=0)) / 2.0
    assert np.linalg.norm(middles[:, :2], axis=1).min() >= 50.0 - 1e-9


@pytest.mark.parametrize("hand", HANDS)
def test_fingers_meet_just_below_the_least_opening(hand: HandModel) -> None:
    floor = hand.opening_floor_mm(EXTERNAL)
    half = max(solid.vertices_mm[:, 1].max() for solid in hand.finger(10.0, EXTERNAL))
    if hand.fingers == 2:
        assert floor == 0.0
        return
    corner = np.array([floor / 2.0, half])  # of finger 1, next to finger 2
    between = np.array([np.cos(np.pi / hand.fingers), np.sin(np.pi / hand.fingers)])
    assert 2.0 * (corner @ between) * between - corner == pytest.approx(corner)  # it lies on the plane between the two


@pytest.mark.parametrize("hand", HANDS[:2])
@pytest.mark.parametrize("seed", range(3))
def test_axial_grasps_hold_a_cylinder_from_both_ends_in_any_pose(seed: int, hand: HandModel) -> None:
    X = turned_pose(seed)
    component = component_of(moved(turned_mesh(((0.0, 0.0), (12.0, 0.0), (12.0, 20.0), (0.0, 20.0)), 72), X))
    axis = X[:3, 2]
    cylinder = Cylinder(
        center_C=X[:3, 3] + 10.0 * axis,
        axis_C=axis,
        radius_mm=12.0,
        height_mm=20.0,
        internal=False,
        arc_rad=2 * np.pi,
        rms_mm=0.0,
        surface_filled=True,
    )
    need = GripRequirement(
        gripper_type=hand.gripper_type,
        opening_width_mm=24.0,
        approach_C=np.stack([axis, -axis]),
        grip_axes_C=np.zeros((0, 3)),
        primitive=cylinder,
    )

    grasps = AxialPlanner(AxialSettings()).plan(component, whole(component), need, hand, RunContext())

    assert {round(float(grasp.X_CG[:3, 2] @ axis)) for grasp in grasps} == {-1, 1}
    assert all(is_rigid(grasp.X_CG) for grasp in grasps)
    surface = Surface(component.mesh)
    seated = [seat(grasp, surface, hand) for grasp in grasps]
    held = [grasp for grasp in seated if isinstance(grasp, Grasp)]
    assert len(held) == len(grasps)
    assert all(len(contacts(grasp, surface, hand, 30.0, 3.0)) == hand.fingers for grasp in held)  # type: ignore[arg-type]
    assert [grasp.opening_width_mm for grasp in held] == pytest.approx(np.full(len(held), 24.0), abs=0.06)


@pytest.mark.parametrize("seed", range(3))
def test_facet_pairs_hold_a_box_across_its_faces_in_any_pose(seed: int) -> None:
    X = turned_pose(seed)
    component = component_of(moved(box_mesh((30.0, 20.0, 12.0)), X))
    X_CB = X.copy()
    X_CB[:3, 3] = X[:3, 3] + X[:3, :3] @ np.array([15.0, 10.0, 6.0])
    box = Box(X_CB=X_CB, extents_mm=np.array([30.0, 20.0, 12.0]), filled=np.ones(6), filled_min=0.3, rms_mm=0.0)
    need = GripRequirement(
        gripper_type=PARALLEL_2, opening_width_mm=20.0, approach_C=np.zeros((0, 3)), grip_axes_C=X[:3, 1][None], primitive=box
    )
    hand = ParallelHand(HandSettings())

    grasps = FacetPairPlanner(FacetPairSettings()).plan(component, whole(component), need, hand, RunContext())

    assert len(grasps) > 100
    assert all(is_rigid(grasp.X_CG) for grasp in grasps)
    assert [abs(float(grasp.X_CG[:3, 0] @ X[:3, 1])) for grasp in grasps] == pytest.approx(np.ones(len(grasps)))
    surface = Surface(component.mesh)
    for grasp in grasps[::17]:
        seated = seat(grasp, surface, hand)
        assert isinstance(seated, Grasp)
        assert seated.opening_width_mm == pytest.approx(20.0, abs=0.01)
        assert isinstance(contacts(seated, surface, hand, 60.0, 3.0), tuple)


def test_facets_that_face_each_other_across_a_slot_are_no_pair() -> None:
    component = component_of(box_mesh((30.0, 20.0, 12.0)))
    inside_out = component_of(
        type(component.mesh)(vertices_mm=component.mesh.vertices_mm, faces=component.mesh.faces[:, ::-1].copy())
    )
    box = Box(X_CB=np.eye(4), extents_mm=np.array([30.0, 20.0, 12.0]), filled=np.ones(6), filled_min=0.3, rms_mm=0.0)
    need = GripRequirement(
        gripper_type=PARALLEL_2, opening_width_mm=20.0, approach_C=np.zeros((0, 3)), grip_axes_C=np.eye(3)[1:2], primitive=box
    )
    planner, hand = FacetPairPlanner(FacetPairSettings()), ParallelHand(HandSettings())

    assert face_normals(inside_out.mesh).shape == (12, 3)
    assert len(planner.plan(inside_out, whole(inside_out), need, hand, RunContext())) == 0


def square_bar(X: FloatArray, sides: tuple[float, float]) -> tuple[Component, Box, GripRequirement]:
    """A bar 30 long, planned for four fingers around its axis as if it were square."""
    component = component_of(moved(box_mesh((*sides, 30.0)), X))
    X_CB = X.copy()
    X_CB[:3, 3] = X[:3, 3] + X[:3, :3] @ np.array([sides[0] / 2.0, sides[1] / 2.0, 15.0])
    box = Box(X_CB=X_CB, extents_mm=np.array([*sides, 30.0]), filled=np.ones(6), filled_min=0.3, rms_mm=0.0)
    need = GripRequirement(
        gripper_type=CENTRIC_4,
        opening_width_mm=float(np.mean(sides)),
        approach_C=np.stack([X[:3, 2], -X[:3, 2]]),
        grip_axes_C=np.zeros((0, 3)),
        primitive=box,
    )
    return component, box, need


@pytest.mark.parametrize("seed", range(3))
def test_four_fingers_stand_square_on_the_sides_of_a_square_bar(seed: int) -> None:
    X = turned_pose(seed)
    component, _, need = square_bar(X, (16.0, 16.0))

    grasps = AxialPlanner(AxialSettings()).plan(component, whole(component), need, FOUR, RunContext())

    surface = Surface(component.mesh)
    assert {round(float(grasp.X_CG[:3, 2] @ X[:3, 2])) for grasp in grasps} == {-1, 1}
    for grasp in grasps:
        seated = seat(grasp, surface, FOUR)
        assert isinstance(seated, Grasp)
        assert seated.opening_width_mm == pytest.approx(16.0, abs=0.01)
        touching = contacts(seated, surface, FOUR, 60.0, 3.0)
        assert isinstance(touching, tuple)
        assert [contact.area_mm2 for contact in touching] == pytest.approx([10.0 * touching[0].height_mm] * 4, rel=1e-3)


@pytest.mark.parametrize(("uneven_mm", "held"), [(0.08, True), (0.095, False)])
def test_four_fingers_touch_a_bar_whose_sides_differ_by_no_more_than_twice_the_gap_of_a_touch(
    uneven_mm: float, held: bool
) -> None:
    component, _, need = square_bar(np.eye(4), (16.0, 16.0 + uneven_mm))
    grasp = AxialPlanner(AxialSettings()).plan(component, whole(component), need, FOUR, RunContext())[0]

    seated = seat(grasp, Surface(component.mesh), FOUR)

    assert isinstance(seated, Grasp) is held
    if isinstance(seated, Grasp):
        assert isinstance(contacts(seated, Surface(component.mesh), FOUR, 60.0, 3.0), tuple)


def test_four_fingers_centre_what_they_hold_along_both_of_their_axes() -> None:
    component, _, need = square_bar(np.eye(4), (16.0, 16.0))
    grasp = AxialPlanner(AxialSettings()).plan(component, whole(component), need, FOUR, RunContext())[0]
    aside = replace(grasp, X_CG=grasp.X_CG @ moved_by(0.2, -0.1))

    seated = seat(aside, Surface(component.mesh), FOUR)

    assert isinstance(seated, Grasp)
    assert np.allclose(seated.X_CG, grasp.X_CG, rtol=0.0, atol=1e-9)


def moved_by(x: float, y: float) -> FloatArray:
    X = np.eye(4)
    X[:2, 3] = x, y
    return X
