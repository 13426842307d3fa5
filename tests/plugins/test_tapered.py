"""Rules and planner of tapered tips: which taper, from which end, how wide open."""

from dataclasses import replace
from typing import Any

import manifold3d
import numpy as np
import pytest

from gripwright.design.contact import Surface, contacts, seat
from gripwright.design.stages.rules import requirements
from gripwright.design.tapered_hand import tapered
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.shape import FloatArray, Mesh, Segment
from gripwright.geometry.frames import is_rigid
from gripwright.plugin_api import HandModel, RunContext
from gripwright_builtin.hands.centric import CentricHand, CentricSettings, FourFingerHand
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from gripwright_builtin.planners.axial import AxialPlanner, AxialSettings
from gripwright_builtin.planners.facet_pairs import FacetPairPlanner, FacetPairSettings
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.hold_tapered import (
    FourFingerCone,
    FourFingerPyramid,
    TaperSettings,
    ThreeFingerCone,
    ThreeFingerPyramid,
    TwoFingerPyramid,
)
from gripwright_builtin.shapes.plan_tapered import TaperedPlanner, TaperedSettings
from gripwright_builtin.shapes.pyramid import Pyramid
from mesh_factory import component_of, mesh_of, moved, turned_pose

CONE_RULE, FOUR_CONE_RULE, PAIR_RULE, THREE_RULE, FOUR_RULE = (
    rule(TaperSettings()) for rule in (ThreeFingerCone, FourFingerCone, TwoFingerPyramid, ThreeFingerPyramid, FourFingerPyramid)
)
HANDS: dict[str, HandModel] = {
    CENTRIC_3: CentricHand(CentricSettings()),
    CENTRIC_4: FourFingerHand(CentricSettings()),
    PARALLEL_2: ParallelHand(HandSettings()),
}
RADIUS_MM, HEIGHT_MM = 18.0, 30.0


def top_mm(degrees: float) -> float:
    return float(RADIUS_MM - HEIGHT_MM * np.tan(np.radians(degrees)))


def cone(degrees: float, X: FloatArray | None = None, **changes: Any) -> Cone:
    """Radius 18 at the foot, 30 high; it stands on the origin of X along its z."""
    X = np.eye(4) if X is None else X
    made = Cone(
        center_C=X[:3, 3] + X[:3, 2] * HEIGHT_MM / 2.0, axis_C=X[:3, 2], radius_mm=RADIUS_MM, radius_top_mm=top_mm(degrees),
        height_mm=HEIGHT_MM, internal=False, arc_rad=2.0 * np.pi, ends_filled=np.ones(2), rms_mm=0.0, surface_filled=True,
    )  # fmt: skip
    return replace(made, **changes)


def pyramid(degrees: float, X: FloatArray | None = None, sides: int = 4, **changes: Any) -> Pyramid:
    """36 across its flats at the foot, 30 high."""
    X = np.eye(4) if X is None else X
    made = Pyramid(
        sides=sides, center_C=X[:3, 3] + X[:3, 2] * HEIGHT_MM / 2.0, axis_C=X[:3, 2], side_C=X[:3, 0],
        across_flats_mm=2.0 * RADIUS_MM, across_flats_top_mm=2.0 * top_mm(degrees), height_mm=HEIGHT_MM, internal=False,
        filled=np.ones(sides), ends_filled=np.ones(2), filled_min=0.6, rms_mm=0.0,
    )  # fmt: skip
    return replace(made, **changes)


def asked(rule: Any, fit: Any) -> list[GripRequirement]:
    found = requirements([fit], [rule])
    assert not isinstance(found, Rejection), found
    return found


@pytest.mark.parametrize(("degrees", "taper"), [(12.0, 12.0), (12.2, 12.0), (12.3, 12.5), (0.6, 0.5)])
def test_a_cone_asks_for_its_half_angle_in_steps_from_the_narrow_end_and_from_the_wide_one(degrees: float, taper: float) -> None:
    narrow, wide = asked(CONE_RULE, cone(degrees))

    assert [np.degrees(need.taper_rad) for need in (narrow, wide)] == pytest.approx([-taper, taper])
    assert np.array_equal(narrow.approach_C, [[0.0, 0.0, -1.0]])
    assert np.array_equal(wide.approach_C, [[0.0, 0.0, 1.0]])
    assert {(need.gripper_type, need.rule) for need in (narrow, wide)} == {(CENTRIC_3, "three_finger_cone")}
    assert narrow.opening_width_mm == pytest.approx(RADIUS_MM + top_mm(degrees))


def test_a_pyramid_is_held_across_opposite_sides_and_a_square_one_by_four_fingers() -> None:
    pairs, six, four = (
        asked(rule, fit)[0]
        for rule, fit in ((PAIR_RULE, pyramid(10.0)), (PAIR_RULE, pyramid(10.0, sides=6)), (FOUR_RULE, pyramid(10.0)))
    )

    assert (pairs.gripper_type, four.gripper_type) == (PARALLEL_2, CENTRIC_4)
    assert pairs.grip_axes_C == pytest.approx(np.eye(3)[:2])
    assert np.degrees(np.arctan2(six.grip_axes_C[:, 1], six.grip_axes_C[:, 0])) == pytest.approx([0.0, 60.0, 120.0])
    assert four.grip_axes_C.shape == (0, 3)


@pytest.mark.parametrize(("sides", "filled", "first"), [(3, None, [0.0]), (6, None, [0.0, 60.0]), (6, 3, [0.0])])
def test_three_fingers_stand_on_every_side_that_is_filled_120_degrees_apart(
    sides: int, filled: int | None, first: list[float]
) -> None:
    fit = pyramid(10.0, sides=sides, filled=np.array([float(k != filled) for k in range(sides)]))
    need = asked(THREE_RULE, fit)[0]

    component = component_of(mesh_of(manifold3d.Manifold.cube((1.0, 1.0, 1.0))))  # a pyramid's sides are its own
    segment = Segment(id=0, faces=np.arange(12), area_mm2=6.0, hull_volume_mm3=1.0)
    grasps = TaperedPlanner(TaperedSettings()).plan(component, segment, need, tapered(HANDS[CENTRIC_3], -0.2), RunContext())

    assert need.gripper_type == CENTRIC_3
    turns = {round(float(np.degrees(np.arctan2(*grasp.X_CG[1::-1, 0])))) % 360 for grasp in grasps}
    assert turns == {round(degrees) for degrees in first}


def test_sides_that_are_not_filled_are_not_gripped() -> None:
    (need, _) = asked(PAIR_RULE, pyramid(10.0, filled=np.array([1.0, 1.0, 0.3, 0.9])))

    assert need.grip_axes_C == pytest.approx(np.eye(3)[1:2])


@pytest.mark.parametrize(
    ("rule", "fit", "why"),
    [
        (CONE_RULE, cone(30.3), "the half angle of the cone is 30.3°, tapered tips hold up to 30.0°"),
        (CONE_RULE, cone(10.0, internal=True), "the cone is a bore, tapered tips hold from outside"),
        (PAIR_RULE, pyramid(10.0, internal=True), "the pyramid is a hollow, tapered tips hold from outside"),
        (PAIR_RULE, pyramid(10.0, sides=3), "a pyramid of 3 sides has no opposite ones"),
        (
            PAIR_RULE,
            pyramid(10.0, filled=np.array([0.5, 0.2, 1.0, 1.0])),
            "no pair of opposite sides of the pyramid is filled: the best to 50.0 %, at least 60.0 % needed",
        ),
        (FOUR_RULE, pyramid(10.0, sides=6), "a pyramid of 6 sides has not one every 90°"),
        (THREE_RULE, pyramid(10.0), "a pyramid of 4 sides has not one every 120°"),
        (
            THREE_RULE,
            pyramid(10.0, sides=6, filled=np.array([0.5, 0.4, 1.0, 1.0, 1.0, 1.0])),
            "one of 3 sides of the pyramid is filled to 50.0 %, at least 60.0 % needed",
        ),
        (
            FOUR_RULE,
            pyramid(10.0, filled=np.array([0.5, 1.0, 1.0, 1.0])),
            "one of 4 sides of the pyramid is filled to 50.0 %, at least 60.0 % needed",
        ),
    ],
)
def test_what_tapered_tips_cannot_hold_says_why(rule: Any, fit: Any, why: str) -> None:
    assert requirements([fit], [rule]) == Rejection("no-type", why)


def solid(fit: Cone | Pyramid, degrees: float, X: FloatArray, sections: int) -> Mesh:
    """The surface of a primitive."""
    if isinstance(fit, Cone):
        return moved(mesh_of(manifold3d.Manifold.cylinder(HEIGHT_MM, RADIUS_MM, top_mm(degrees), sections)), X)
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    levels = ((RADIUS_MM, 0.0), (top_mm(degrees), HEIGHT_MM))
    corners = np.concatenate([np.column_stack([square * r, np.full(4, z)]) for r, z in levels])
    return moved(mesh_of(manifold3d.Manifold.hull_points(corners)), X)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("rule", "make", "sections"),
    [
        (CONE_RULE, cone, 192),
        (CONE_RULE, cone, 24),
        (FOUR_CONE_RULE, cone, 192),
        (PAIR_RULE, pyramid, 0),
        (FOUR_RULE, pyramid, 0),
    ],
)
def test_planned_grasps_touch_the_flanks_from_both_ends_in_any_pose(rule: Any, make: Any, sections: int, seed: int) -> None:
    X, degrees = turned_pose(seed), 12.0
    fit = make(degrees, X)
    component = component_of(solid(fit, degrees, X, sections))
    segment = Segment(id=0, faces=np.arange(len(component.mesh.faces)), area_mm2=1.0, hull_volume_mm3=1.0)
    surface, planner = Surface(component.mesh), TaperedPlanner(TaperedSettings())

    for need in asked(rule, fit):
        hand = tapered(HANDS[need.gripper_type], need.taper_rad)
        grasps = planner.plan(component, segment, need, hand, RunContext())

        assert len(grasps) >= 6
        assert all(is_rigid(grasp.X_CG) for grasp in grasps)
        assert [float(grasp.X_CG[:3, 2] @ need.approach_C[0]) for grasp in grasps] == pytest.approx([1.0] * len(grasps))
        touching = 0
        for grasp in grasps:
            seated = seat(grasp, surface, hand)
            assert isinstance(seated, Grasp)
            assert seated.opening_width_mm == pytest.approx(grasp.opening_width_mm, abs=0.35 if sections == 24 else 0.02)
            touching += not isinstance(contacts(seated, surface, hand, 60.0, 3.0), Rejection)
        assert touching >= (len(grasps) if sections != 24 else len(grasps) / 4)  # of coarse facets those that are met


def test_the_other_planners_leave_tapered_tips_alone_and_this_one_straight_ones() -> None:
    fit = cone(12.0)
    component = component_of(solid(fit, 12.0, np.eye(4), 48))
    segment = Segment(id=0, faces=np.arange(len(component.mesh.faces)), area_mm2=1.0, hull_volume_mm3=1.0)
    (need, _), hand = asked(CONE_RULE, fit), tapered(HANDS[CENTRIC_3], -0.2)
    straight = replace(need, taper_rad=0.0)

    for planner in (AxialPlanner(AxialSettings()), FacetPairPlanner(FacetPairSettings())):
        assert len(planner.plan(component, segment, need, hand, RunContext())) == 0
    tips = TaperedPlanner(TaperedSettings())
    assert len(tips.plan(component, segment, straight, HANDS[CENTRIC_3], RunContext())) == 0


def test_tips_that_reach_below_a_wide_end_go_no_deeper_than_they_are_high() -> None:
    fit = cone(12.0)
    component = component_of(solid(fit, 12.0, np.eye(4), 96))
    segment = Segment(id=0, faces=np.arange(len(component.mesh.faces)), area_mm2=1.0, hull_volume_mm3=1.0)
    planner = TaperedPlanner(TaperedSettings())

    narrow, wide = (
        [grasp.X_CG[2, 3] for grasp in planner.plan(component, segment, need, HANDS[CENTRIC_3], RunContext())]
        for need in asked(CONE_RULE, fit)
    )

    assert (min(narrow), max(narrow)) == pytest.approx((0.0, HEIGHT_MM - 3.25))
    assert (min(wide), max(wide)) == pytest.approx((3.25, 10.0))
