from dataclasses import replace

import manifold3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gripwright.design.catalogue import body_size, palm_envelope_mm
from gripwright.design.gripper_assembly import BodyMeasures, gripper_parts, jaw_of, jaw_radius_mm, placed_fingers, reach_mm
from gripwright.design.stages.fingers import GripperCad, design_gripper_cad
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, INTERNAL, Grasp, Hold
from gripwright.domain.gripper import Actuator, Gripper, Handle, JawInterface
from gripwright.domain.shape import Mesh
from gripwright.geometry import brep
from gripwright.geometry.measures import volume_mm3
from gripwright.plugin_api import HandModel, RunContext
from gripwright_builtin.fingers.straight import StraightFinger, StraightFingerParams
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings

BODY_LENGTH_MM = 55.0


def make_hand(fingers: int) -> HandModel:
    return ParallelHand(HandSettings()) if fingers == 2 else CentricHand(CentricSettings())


def make_gripper(
    fingers: int = 3,
    *,
    opening_mm: float = 60.5,
    stroke_mm: float = 8.0,
    jaw_offset_mm: float = 9.25,
    grip: str = EXTERNAL,
    length_mm: float = 30.0,
    body_diameter_mm: float = 40.0,
) -> Gripper:
    hand = make_hand(fingers)
    actuator = Actuator(
        maker="Maker",
        model="M1",
        gripper_type=hand.gripper_type,
        stroke_mm=stroke_mm,
        opening_max_mm=opening_mm - 2.0 * jaw_offset_mm,
        grip_force_N=10.0,
        body_diameter_mm=body_diameter_mm,
        body_length_mm=BODY_LENGTH_MM,
    )
    return Gripper(
        id="G1",
        gripper_type=hand.gripper_type,
        fingers=fingers,
        grip=grip,
        opening_min_mm=max(opening_mm - stroke_mm, hand.opening_floor_mm(grip)),
        opening_max_mm=opening_mm,
        finger_length_mm=length_mm,
        actuator=actuator,
        jaw_offset_mm=jaw_offset_mm,
        envelope_mm=palm_envelope_mm(actuator, opening_mm),
        handles=(),
    )


def with_handle(gripper: Gripper, *, required_force_N: float) -> Gripper:
    grasp = Grasp(X_CG=np.eye(4), gripper_type=gripper.gripper_type, grip=gripper.grip, opening_width_mm=gripper.opening_max_mm)
    handle = Handle(
        operation="op-1",
        component="disc",
        segment=0,
        opening_width_mm=gripper.opening_max_mm,
        release_opening_mm=gripper.opening_max_mm,
        grasp=grasp,
        gap_mm=1.0,
        hold=Hold(required_force_N=required_force_N, moment_Nmm=0.0, symmetry=1.0),
        safety_factor=None,
    )
    return replace(gripper, handles=(handle,))


def answer(gripper: Gripper, **params) -> GripperCad | Rejection:
    designer = StraightFinger(StraightFingerParams(**params))
    hand = make_hand(gripper.fingers)
    needed = max((handle.hold.required_force_N for handle in gripper.handles), default=0.0)
    return design_gripper_cad(gripper, designer, hand, (), *body_size(gripper.actuator), needed, 2.0, RunContext())


def make_cad(gripper: Gripper) -> GripperCad:
    cad = answer(gripper)
    assert isinstance(cad, GripperCad), cad
    return cad


def grippers() -> st.SearchStrategy[Gripper]:
    """W 5..200, L 5..120, jaws 20 mm outside to 60 mm inside of the gripping surface, as far as an actuator can have them."""

    def build(fingers: int, opening: float, length: float, stroke: float, offset: float, grip: str, diameter: float) -> Gripper:
        opening = max(opening, make_hand(fingers).opening_floor_mm(grip))
        low = make_gripper(fingers, opening_mm=opening, stroke_mm=stroke, grip=grip).opening_min_mm
        nearest = 5.5 if fingers == 3 else 0.0
        return make_gripper(
            fingers,
            opening_mm=opening,
            stroke_mm=stroke,
            grip=grip,
            length_mm=length,
            jaw_offset_mm=min(offset, low / 2.0 - nearest, opening / 2.0 - 8.0),
            body_diameter_mm=diameter,
        )

    return st.builds(
        build,
        st.sampled_from([2, 3]),
        st.floats(5, 200),
        st.floats(5, 120),
        st.floats(2, 50),
        st.floats(-20, 60),
        st.sampled_from([EXTERNAL, INTERNAL]),
        st.floats(20, 120),
    )


def solid(mesh: Mesh) -> manifold3d.Manifold:
    """The mesh as a manifold; a mesh that is not closed has an error status."""
    made = manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices_mm.copy(), mesh.faces.astype(np.uint64)))
    assert made.status() == manifold3d.Error.NoError
    return made


@settings(max_examples=15, deadline=None)
@given(grippers())
def test_fingers_and_body_never_intersect_at_either_end_of_the_opening_range(gripper: Gripper) -> None:
    cad, hand = make_cad(gripper), make_hand(gripper.fingers)

    for opening in (gripper.opening_min_mm, gripper.opening_max_mm):
        fingers = [solid(mesh) for mesh in placed_fingers(cad.finger.mesh, hand.finger_poses(opening))]
        pairs = [(a, b) for i, a in enumerate(fingers) for b in [*fingers[:i], solid(cad.body)]]
        assert max((a ^ b).volume() for a, b in pairs) < 1e-3


@settings(max_examples=15, deadline=None)
@given(grippers())
def test_the_body_is_one_closed_solid_inside_the_palm_envelope(gripper: Gripper) -> None:
    cad = make_cad(gripper)

    exact = brep.single_solid(brep.read_brep(cad.body_brep))
    assert len(solid(cad.body).decompose()) == 1
    assert volume_mm3(cad.body) == pytest.approx(brep.measure(exact).volume_mm3, rel=5e-3)
    assert reach_mm(cad.body) <= gripper.envelope_mm + 1e-6
    assert cad.body.vertices_mm[:, 2].max() == pytest.approx(cad.finger.mesh.vertices_mm[:, 2].min(), abs=1e-6)


@pytest.mark.parametrize("fingers", [2, 3])
def test_the_body_has_at_least_the_actuators_size(fingers: int) -> None:
    cad = make_cad(make_gripper(fingers))

    behind = cad.body.vertices_mm[cad.body.vertices_mm[:, 2] < cad.measures.front_mm - 15.5]
    assert np.ptp(cad.body.vertices_mm[:, 2]) == pytest.approx(BODY_LENGTH_MM)
    assert np.hypot(behind[:, 0], behind[:, 1]).max() == pytest.approx(20.0, abs=1e-6)


@pytest.mark.parametrize("grip", [EXTERNAL, INTERNAL])
@pytest.mark.parametrize("fingers", [2, 3])
def test_fingers_bolted_to_the_jaws_give_the_designs_opening_range(fingers: int, grip: str) -> None:
    gripper = make_gripper(fingers, grip=grip)
    cad, hand = make_cad(gripper), make_hand(fingers)
    reference_open = 2.0 * jaw_radius_mm(gripper, gripper.opening_max_mm)

    for travelled, opening in ((0.0, gripper.opening_max_mm), (gripper.actuator.stroke_mm, gripper.opening_min_mm)):
        jaw_radius = (reference_open - travelled) / 2.0
        bolt_radius = jaw_radius + cad.spec.jaw.bolt_setback_mm
        surface_radius = bolt_radius - cad.finger.properties["bolt_x_mm"]
        assert 2.0 * surface_radius == pytest.approx(opening, abs=0.02)
        tip = placed_fingers(cad.finger.mesh, hand.finger_poses(2.0 * surface_radius))[0].vertices_mm
        radial = tip[tip[:, 2] > -1e-6][:, 0]
        assert 2.0 * (radial.min() if grip == EXTERNAL else radial.max()) == pytest.approx(opening, abs=0.02)


def test_the_parts_at_an_opening_are_the_actuator_and_a_jaw_for_each_finger() -> None:
    gripper = make_gripper()
    cad = make_cad(gripper)

    parts = {part.name: part.mesh for part in gripper_parts(gripper, make_hand(3), cad.finger, cad.measures, cad.spec.jaw, 55.0)}

    assert list(parts) == ["actuator", "jaw-1", "jaw-2", "jaw-3", "finger-1", "finger-2", "finger-3", "pad-1", "pad-2", "pad-3"]
    assert parts["jaw-1"].vertices_mm[:, 0].min() == pytest.approx(55.0 / 2.0 - 9.25)
    assert parts["finger-1"].vertices_mm[:, 2].max() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("body_diameter_mm", "thread_mm"), [(30.0, 2.5), (40.0, 2.5), (56.0, 3.0), (80.0, 4.0), (150.0, 4.0)])
def test_an_actuator_has_the_largest_standard_jaws_that_its_size_allows(body_diameter_mm: float, thread_mm: float) -> None:
    actuator = make_gripper(body_diameter_mm=body_diameter_mm).actuator

    assert jaw_of(actuator).bolt_thread_mm == thread_mm


def test_an_actuator_has_the_same_jaws_in_every_gripper() -> None:
    small, large = (make_gripper(opening_mm=width, jaw_offset_mm=width / 2.0 - 25.0) for width in (20.0, 120.0))

    assert small.actuator == large.actuator
    assert make_cad(small).spec.jaw == make_cad(large).spec.jaw


@pytest.mark.parametrize("diameter_mm", [10.0, 30.0, 40.0, 80.0, 150.0])
def test_a_block_lies_in_the_circle_of_the_actuators_diameter(diameter_mm: float) -> None:
    sides = BodyMeasures(front_mm=0.0, diameter_mm=diameter_mm, length_mm=1.0).sides_mm(JawInterface())

    assert np.hypot(*sides) == pytest.approx(diameter_mm)
    assert sides[0] >= sides[1] - 1e-9


def test_a_body_larger_than_the_envelope_is_rejected() -> None:
    gripper = make_gripper(opening_mm=20.0, jaw_offset_mm=0.0)

    rejected = answer(replace(gripper, envelope_mm=19.0))

    assert isinstance(rejected, Rejection)
    assert rejected.code in {"body-outside-envelope", "base-outside-envelope"}


def test_fingers_too_weak_for_a_strong_actuator_are_made_for_what_their_handles_need() -> None:
    weak = make_gripper(length_mm=100.0)
    strong = replace(weak, actuator=replace(weak.actuator, grip_force_N=3000.0))

    assert isinstance(answer(weak), GripperCad)
    assert make_cad(weak).grip_force_max_N is None
    assert make_cad(strong).grip_force_max_N == 0.0
    assert make_cad(with_handle(strong, required_force_N=30.0)).grip_force_max_N == pytest.approx(60.0)
    assert make_cad(with_handle(strong, required_force_N=30.0)).spec.grip_force_N == pytest.approx(60.0)


def test_a_gripper_whose_handles_need_more_than_its_fingers_bear_is_rejected() -> None:
    gripper = make_gripper(length_mm=100.0)
    strong = replace(gripper, actuator=replace(gripper.actuator, grip_force_N=3000.0))

    rejected = answer(with_handle(strong, required_force_N=1400.0))

    assert isinstance(rejected, Rejection)
    assert rejected.code == "finger-too-weak"


def test_a_stem_thicker_than_the_hand_model_is_rejected() -> None:
    rejected = answer(make_gripper(), thickness=9.0)

    assert isinstance(rejected, Rejection)
    assert rejected.code == "finger-outside-hand"
    assert "1.00 mm" in rejected.detail
