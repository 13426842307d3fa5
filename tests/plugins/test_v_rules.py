"""Rules and planner of V tips: which V and taper, how wide open, and what they touch."""

from dataclasses import replace
from typing import Any

import manifold3d
import numpy as np
import pytest

from gripwright.design.contact import Surface, contacts, seat
from gripwright.design.stages.rules import requirements
from gripwright.design.tapered_hand import tapered
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.shape import Cylinder, FloatArray, Segment
from gripwright.geometry.frames import is_rigid
from gripwright.plugin_api import RunContext
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from gripwright_builtin.planners.facet_pairs import FacetPairPlanner, FacetPairSettings
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.hold_v import ConeVSettings, TwoFingerCone, TwoFingerCylinder, VSettings
from gripwright_builtin.shapes.plan_tapered import TaperedPlanner, TaperedSettings
from mesh_factory import component_of, mesh_of, moved, turned_pose

CONE_RULE, CYLINDER_RULE = TwoFingerCone(ConeVSettings()), TwoFingerCylinder(VSettings())
HAND, PLANNER = ParallelHand(HandSettings()), TaperedPlanner(TaperedSettings(rotation_step=45.0, depths=3))
RADIUS_MM, HEIGHT_MM = 8.0, 24.0


def cone(degrees: float, X: FloatArray | None = None, radius_mm: float = RADIUS_MM, **changes: Any) -> Cone:
    """24 high; it stands on the origin of X along its z."""
    X = np.eye(4) if X is None else X
    made = Cone(
        center_C=X[:3, 3] + X[:3, 2] * HEIGHT_MM / 2.0, axis_C=X[:3, 2], radius_mm=radius_mm,
        radius_top_mm=radius_mm - HEIGHT_MM * float(np.tan(np.radians(degrees))), height_mm=HEIGHT_MM, internal=False,
        arc_rad=2.0 * np.pi, ends_filled=np.ones(2), rms_mm=0.0, surface_filled=True,
    )  # fmt: skip
    return replace(made, **changes)


def cylinder(X: FloatArray | None = None, radius_mm: float = RADIUS_MM, **changes: Any) -> Cylinder:
    """24 high; it stands on the origin of X along its z."""
    X = np.eye(4) if X is None else X
    made = Cylinder(
        center_C=X[:3, 3] + X[:3, 2] * HEIGHT_MM / 2.0, axis_C=X[:3, 2], radius_mm=radius_mm, height_mm=HEIGHT_MM,
        internal=False, arc_rad=2.0 * np.pi, rms_mm=0.0, surface_filled=True,
    )  # fmt: skip
    return replace(made, **changes)


def asked(rule: Any, fit: Any) -> list[GripRequirement]:
    found = requirements([fit], [rule])
    assert not isinstance(found, Rejection), found
    return found


def test_a_cylinder_asks_for_a_v_without_taper_that_holds_its_radius_from_either_end() -> None:
    (need,) = asked(CYLINDER_RULE, cylinder())

    assert (need.gripper_type, need.rule, need.taper_rad) == (PARALLEL_2, "two_finger_cylinder", 0.0)
    assert need.vee is not None
    assert (need.vee.degrees, need.vee.depth_mm) == (120.0, 3.0)
    assert need.opening_width_mm == pytest.approx(2.0 * (RADIUS_MM / np.sin(np.radians(60.0)) - 3.0))
    assert need.approach_C.tolist() == [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize(("degrees", "taper"), [(8.0, 8.0), (8.2, 8.0), (8.3, 8.5), (0.6, 0.5)])
def test_a_cone_asks_for_its_half_angle_in_steps_from_the_narrow_end_and_from_the_wide_one(degrees: float, taper: float) -> None:
    narrow, wide = asked(CONE_RULE, cone(degrees))

    assert [np.degrees(need.taper_rad) for need in (narrow, wide)] == pytest.approx([-taper, taper])
    assert (narrow.approach_C.tolist(), wide.approach_C.tolist()) == ([[0.0, 0.0, -1.0]], [[0.0, 0.0, 1.0]])
    assert {(need.gripper_type, need.rule, need.vee) for need in (narrow, wide)} == {
        (PARALLEL_2, "two_finger_cone", asked(CYLINDER_RULE, cylinder())[0].vee)
    }


@pytest.mark.parametrize(
    ("rule", "fit", "why"),
    [
        (CYLINDER_RULE, cylinder(internal=True), "the cylinder is a bore, V tips hold from outside"),
        (CONE_RULE, cone(8.0, internal=True), "the cone is a bore, V tips hold from outside"),
        (CONE_RULE, cone(30.3), "the half angle of the cone is 30.3°, tapered tips hold up to 30.0°"),
        (
            CYLINDER_RULE,
            cylinder(radius_mm=10.0),
            "the cylinder has a radius of 10.00 mm, a V of 120° and 3 mm holds 3.03 to 9.39 mm",
        ),
        (
            CYLINDER_RULE,
            cylinder(radius_mm=3.0),
            "the cylinder has a radius of 3.00 mm, a V of 120° and 3 mm holds 3.03 to 9.39 mm",
        ),
        (CONE_RULE, cone(8.0, radius_mm=14.0), "the cone has a radius of 10.63 mm, a V of 120° and 3 mm holds 3.03 to 9.39 mm"),
        (
            TwoFingerCylinder(VSettings(v_angle=90.0, v_depth=4.0)),
            cylinder(radius_mm=3.0),
            "the cylinder has a radius of 3.00 mm, a V of 90° and 4 mm holds 3.18 to 4.95 mm",
        ),
    ],
)
def test_what_v_tips_cannot_hold_says_why(rule: Any, fit: Any, why: str) -> None:
    assert requirements([fit], [rule]) == Rejection("no-type", why)


@pytest.mark.parametrize(
    ("angle", "depth_mm", "degrees", "sections"),
    [
        (120.0, 3.0, 0.0, 192),
        (120.0, 3.0, 0.0, 24),
        (120.0, 3.0, 9.0, 192),
        (120.0, 3.0, 9.0, 24),
        (90.0, 7.0, 9.0, 192),
        (150.0, 1.4, 0.0, 192),
    ],
)
def test_planned_grasps_touch_with_both_flanks_from_both_ends_in_any_pose(
    angle: float, depth_mm: float, degrees: float, sections: int
) -> None:
    X = turned_pose(int(angle) + sections)
    top = RADIUS_MM - HEIGHT_MM * np.tan(np.radians(degrees))
    component = component_of(moved(mesh_of(manifold3d.Manifold.cylinder(HEIGHT_MM, RADIUS_MM, top, sections)), X))
    segment = Segment(id=0, faces=np.arange(len(component.mesh.faces)), area_mm2=1.0, hull_volume_mm3=1.0)
    rule: Any = (
        TwoFingerCone(ConeVSettings(v_angle=angle, v_depth=depth_mm))
        if degrees
        else TwoFingerCylinder(VSettings(v_angle=angle, v_depth=depth_mm))
    )
    fit = cone(degrees, X) if degrees else cylinder(X)
    touched = []

    for need in asked(rule, fit):
        hand = tapered(HAND, need.taper_rad, need.vee)
        grasps = PLANNER.plan(component, segment, need, hand, RunContext())

        assert len(grasps) >= 4
        assert all(is_rigid(grasp.X_CG) for grasp in grasps)
        assert max(np.abs(grasp.X_CG[:3, 2] @ fit.axis_C) for grasp in grasps) == pytest.approx(1.0)
        for grasp in grasps:
            seated = seat(grasp, Surface(component.mesh), hand)
            if not isinstance(seated, Grasp):
                continue
            near = 0.35 if sections == 24 else 0.02
            assert seated.opening_width_mm == pytest.approx(grasp.opening_width_mm, abs=near)
            found = contacts(seated, Surface(component.mesh), hand, 60.0, 3.0)
            touched.append((grasp, found) if not isinstance(found, Rejection) else (grasp, None))

    assert sum(found is not None for _, found in touched) >= len(touched) / (4 if sections == 24 else 1)
    held = [(grasp, found) for grasp, found in touched if found is not None]
    assert len(held) >= 6
    for grasp, found in held if sections != 24 else []:
        from_axis = np.abs((found[0].centre_C - grasp.X_CG[:3, 3]) @ grasp.X_CG[:3, 0]) - grasp.opening_width_mm / 2.0
        inner = 12.0 * np.tan(np.radians(degrees))  # how far from the middle of a tip's contact its nearer end may be
        assert -0.05 <= from_axis - grasp.contact_offset_mm <= 0.05 + inner


def test_the_planner_of_facets_leaves_v_tips_alone_and_depths_keep_to_what_the_v_holds() -> None:
    fit = cone(9.0)
    component = component_of(mesh_of(manifold3d.Manifold.cylinder(HEIGHT_MM, RADIUS_MM, fit.radius_top_mm, 192)))
    segment = Segment(id=0, faces=np.arange(len(component.mesh.faces)), area_mm2=1.0, hull_volume_mm3=1.0)
    narrow, wide = asked(CONE_RULE, fit)

    assert len(FacetPairPlanner(FacetPairSettings()).plan(component, segment, narrow, HAND, RunContext())) == 0
    tips = [
        sorted({round(float(grasp.X_CG[2, 3]), 3) for grasp in PLANNER.plan(component, segment, need, HAND, RunContext())})
        for need in (narrow, wide)
    ]
    assert (tips[0][0], tips[0][-1]) == pytest.approx((0.0, HEIGHT_MM - 3.25))
    assert (tips[1][0], tips[1][-1]) == pytest.approx((3.25, 10.0))
