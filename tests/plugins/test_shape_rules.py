"""Which gripper holds a cone, a pyramid, a sphere, a torus, a prism, a profile; and that its fingers touch what they should."""

import numpy as np
import pytest

from fitting_cases import whole_segment
from gripwright.design.contact import Surface, contacts, seat
from gripwright.design.stages.rules import requirements
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, INTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Cylinder, Mesh, Primitive
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from gripwright_builtin.planners.axial import AxialPlanner, AxialSettings
from gripwright_builtin.planners.facet_pairs import FacetPairPlanner, FacetPairSettings
from gripwright_builtin.shapes.cone import ConeFitter, ConeParams
from gripwright_builtin.shapes.extrusion import ExtrusionFitter, ExtrusionParams
from gripwright_builtin.shapes.hold_ends import EndsParams, TwoFingerEnds
from gripwright_builtin.shapes.hold_extrusion import ExtrusionHoldParams, TwoFingerExtrusion
from gripwright_builtin.shapes.hold_prism import ThreeFingerPrism, TwoFingerPrism
from gripwright_builtin.shapes.hold_slender import StraightCone, StraightParams, StraightPyramid
from gripwright_builtin.shapes.hold_sphere import SphereHoldParams, ThreeFingerSphere
from gripwright_builtin.shapes.hold_torus import ThreeFingerTorus, TorusHoldParams, TwoFingerTorus
from gripwright_builtin.shapes.prism import PrismFitter, PrismParams
from gripwright_builtin.shapes.pyramid import PyramidFitter, PyramidParams
from gripwright_builtin.shapes.sphere import SphereFitter, SphereParams
from gripwright_builtin.shapes.torus import TorusFitter, TorusParams
from shape_solids import Manifold, cone, placed, profile, pyramid, slot, surface, torus, turned_pose, zone

X = turned_pose(7)
PLANNERS = {
    CENTRIC_3: (AxialPlanner(AxialSettings()), CentricHand(CentricSettings())),
    PARALLEL_2: (FacetPairPlanner(FacetPairSettings()), ParallelHand(HandSettings())),
}
FITTERS = [
    ConeFitter(ConeParams()),
    PyramidFitter(PyramidParams()),
    SphereFitter(SphereParams()),
    TorusFitter(TorusParams()),
    PrismFitter(PrismParams()),
    ExtrusionFitter(ExtrusionParams()),
]
HEXAGON = surface(pyramid(6, 17.0, 17.0, 12.0))


def fitted(mesh: Mesh, kind: str) -> Primitive:
    for fitter in FITTERS:
        if fitter.key == kind:
            one = fitter.fit(*whole_segment(mesh), RunContext())
            assert not isinstance(one, Rejection), one
            return one
    raise KeyError(kind)


def touch(mesh: Mesh, requirement: GripRequirement) -> bool:
    """Whether some planned grasp touches with all fingers."""
    planner, hand = PLANNERS[requirement.gripper_type]
    component, segment = whole_segment(mesh)
    around = Surface(mesh)
    for grasp in planner.plan(component, segment, requirement, hand, RunContext()):
        seated = seat(grasp, around, hand)
        if not isinstance(seated, Rejection) and not isinstance(contacts(seated, around, hand, 30.0, 3.0), Rejection):
            return True
    return False


@pytest.mark.parametrize(
    ("kind", "solid", "rule", "gripper_type", "opening"),
    [
        ("prism", HEXAGON, TwoFingerPrism(Params()), PARALLEL_2, 17.0),
        ("prism", HEXAGON, ThreeFingerPrism(Params()), CENTRIC_3, 17.0),
        ("prism", surface(pyramid(3, 20.0, 20.0, 15.0)), ThreeFingerPrism(Params()), CENTRIC_3, 20.0),
        ("prism", surface(pyramid(8, 20.0, 20.0, 15.0)), TwoFingerPrism(Params()), PARALLEL_2, 20.0),
        ("prism", surface(pyramid(5, 20.0, 20.0, 15.0)), TwoFingerEnds(EndsParams()), PARALLEL_2, 15.0),
        ("cone", surface(cone(20.0, 12.0, 10.0, 64)), TwoFingerEnds(EndsParams()), PARALLEL_2, 10.0),
        ("cone", surface(cone(15.0, 14.7, 30.0, 64)), StraightCone(StraightParams()), CENTRIC_3, 29.7),
        ("pyramid", surface(pyramid(6, 20.0, 19.3, 30.0)), StraightPyramid(StraightParams()), PARALLEL_2, 19.65),
        ("pyramid", surface(pyramid(3, 20.0, 19.3, 30.0)), StraightPyramid(StraightParams()), CENTRIC_3, 19.65),
        ("sphere", surface(zone(40.0, -30.0, 40.0, 144)), ThreeFingerSphere(SphereHoldParams()), CENTRIC_3, 80.0),
        ("torus", surface(torus(30.0, 6.0, 360.0, 144)), TwoFingerTorus(TorusHoldParams()), PARALLEL_2, 12.0),
        ("torus", surface(torus(60.0, 30.0, 360.0, 256)), ThreeFingerTorus(TorusHoldParams()), CENTRIC_3, 180.0),
        ("extrusion", surface(profile(slot(40.0, 14.0), 20.0)), TwoFingerExtrusion(ExtrusionHoldParams()), PARALLEL_2, 14.0),
    ],
    ids=lambda value: getattr(value, "key", None),
)
def test_fingers_touch_what_the_rule_asks_for(kind, solid, rule, gripper_type, opening):
    mesh = placed(solid, X)

    asked = requirements([fitted(mesh, kind)], [rule])

    assert not isinstance(asked, Rejection), asked
    assert asked[0].gripper_type == gripper_type
    assert asked[0].opening_width_mm == pytest.approx(opening, rel=2e-3)
    assert asked[0].rule == rule.key
    assert touch(mesh, asked[0])


@pytest.mark.parametrize(
    ("kind", "solid", "rule", "says"),
    [
        (
            "cone",
            surface(cone(15.0, 10.0, 30.0, 64)),
            StraightCone(StraightParams()),
            "half angle of 9.46°, straight fingers touch up to 0.86°",
        ),
        (
            "pyramid",
            surface(pyramid(6, 20.0, 10.0, 30.0)),
            StraightPyramid(StraightParams()),
            "half angle of 9.46°, straight fingers touch up to 0.86°",
        ),
        (
            "cone",
            surface(cone(15.0, 0.0, 30.0, 64)),
            TwoFingerEnds(EndsParams()),
            "an end face of the cone is filled to 0.0 %, at least 10.0 %",
        ),
        (
            "sphere",
            surface(zone(12.0, -12.0, 12.0, 48)),
            ThreeFingerSphere(SphereHoldParams()),
            "equator 2.08 mm high, at least 3.00 mm",
        ),
        (
            "sphere",
            surface(zone(60.0, 20.0, 60.0, 96)),
            ThreeFingerSphere(SphereHoldParams()),
            "equator 0.00 mm high, at least 3.00 mm",
        ),
        (
            "torus",
            surface(torus(20.0, 6.0, 360.0, 96)),
            ThreeFingerTorus(TorusHoldParams()),
            "equator 1.47 mm high, at least 3.00 mm",
        ),
        (
            "torus",
            surface(torus(80.0, 30.0, 90.0, 96)),
            ThreeFingerTorus(TorusHoldParams()),
            "goes round by 90.0°, three fingers need more than 240°",
        ),
        ("prism", surface(pyramid(5, 20.0, 20.0, 15.0)), TwoFingerPrism(Params()), "of 5 even sides no two are parallel"),
        ("prism", surface(pyramid(8, 20.0, 20.0, 15.0)), ThreeFingerPrism(Params()), "of 8 even sides no three stand 120° apart"),
        (
            "extrusion",
            surface(profile([(0.0, 0.0), (30.0, 0.0), (10.0, 20.0)], 9.0)),
            TwoFingerExtrusion(ExtrusionHoldParams()),
            "parallel facets lie opposite along 0.00 mm, at least 3.00 mm",
        ),
    ],
)
def test_what_straight_fingers_cannot_hold_is_refused_with_the_measure_and_the_limit(kind, solid, rule, says):
    answer = requirements([fitted(placed(solid, X), kind)], [rule])

    assert isinstance(answer, Rejection), answer
    assert answer.code == "no-type"
    assert says in answer.detail


def test_a_hexagonal_socket_is_held_by_nothing_from_outside():
    block = Manifold.cube((40.0, 40.0, 12.0)).translate((-20.0, -20.0, 0.0)) - pyramid(6, 17.0, 17.0, 14.0).translate((0, 0, -1))
    mesh = surface(block)
    inside = np.flatnonzero(np.linalg.norm(mesh.triangles_mm.mean(axis=1)[:, :2], axis=1) < 10.0)
    walls = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[inside][np.ptp(mesh.triangles_mm[inside][:, :, 2], axis=1) > 1.0])

    answers = [requirements([fitted(walls, "prism")], [rule]) for rule in (TwoFingerPrism(Params()), ThreeFingerPrism(Params()))]

    assert all(isinstance(answer, Rejection) and "is a socket" in answer.detail for answer in answers)


def test_all_pairs_of_parallel_flats_are_asked_for_at_once():
    prism = fitted(placed(HEXAGON, X), "prism")

    (asked,) = requirements([prism], [TwoFingerPrism(Params())])

    assert asked.grip_axes_C.shape == (3, 3)
    assert np.abs(asked.grip_axes_C @ X[:3, 2]) == pytest.approx(np.zeros(3), abs=1e-9)
    assert sorted(np.round(np.abs(asked.grip_axes_C @ X[:3, 0]), 6)) == pytest.approx([0.5, 0.5, 1.0])


def test_a_large_sphere_with_a_neck_is_held_about_the_neck_s_axis_first():
    sphere = fitted(surface(zone(60.0, -50.0, 60.0, 96), X), "sphere")

    asked = requirements([sphere], [ThreeFingerSphere(SphereHoldParams())])

    assert len(asked) == 3
    assert abs(asked[0].primitive.axis_C @ X[:3, 2]) == pytest.approx(1.0, abs=1e-3)
    assert all(isinstance(one.primitive, Cylinder) and one.grip == EXTERNAL for one in asked)


def test_a_slender_long_cone_is_asked_for_in_bands_that_fingers_reach():
    long = fitted(surface(cone(15.0, 13.5, 120.0, 64), X), "cone")

    asked = requirements([long], [StraightCone(StraightParams())])

    assert [round(one.opening_width_mm, 2) for one in asked] == [29.25, 27.75] or [
        round(one.opening_width_mm, 2) for one in asked
    ] == [27.75, 29.25]
    assert {one.grip for one in asked} == {EXTERNAL}


def test_a_ring_with_a_thick_tube_is_held_from_outside_then_from_its_hole():
    ring = fitted(surface(torus(60.0, 30.0, 360.0, 96), X), "torus")

    asked = requirements([ring], [ThreeFingerTorus(TorusHoldParams())])

    assert [(one.grip, round(one.opening_width_mm)) for one in asked] == [(EXTERNAL, 180), (INTERNAL, 60)]
