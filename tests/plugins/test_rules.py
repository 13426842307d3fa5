from dataclasses import replace

import numpy as np
import pytest

from gripwright.design.stages.rules import requirements
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL, INTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Box, Cylinder, Primitive
from gripwright.plugin_api import Params
from gripwright_builtin.rules.box import FourFingerBox, FourFingerBoxSettings, TwoFingerBox
from gripwright_builtin.rules.cylinder import FourFingerCylinder, ThreeFingerBore, ThreeFingerCylinder

OUTSIDE, BORE, ACROSS = ThreeFingerCylinder(Params()), ThreeFingerBore(Params()), TwoFingerBox(Params())


def cylinder(internal: bool = False) -> Cylinder:
    return Cylinder(
        center_C=np.zeros(3),
        axis_C=np.array([0.0, 0.6, 0.8]),
        radius_mm=12.5,
        height_mm=10.0,
        internal=internal,
        arc_rad=2.0 * np.pi,
        rms_mm=0.0,
        surface_filled=True,
    )


def box(filled: list[float]) -> Box:
    return Box(X_CB=np.eye(4), extents_mm=np.array([10.0, 20.0, 30.0]), filled=np.array(filled), filled_min=0.1, rms_mm=0.0)


def test_a_cylinder_asks_for_three_fingers_at_its_diameter_along_its_axis() -> None:
    found = requirements([cylinder()], [OUTSIDE, BORE, ACROSS])

    assert not isinstance(found, Rejection)
    [requirement] = found
    assert (requirement.gripper_type, requirement.grip, requirement.opening_width_mm) == (CENTRIC_3, EXTERNAL, 25.0)
    assert np.array_equal(np.sort(requirement.approach_C @ cylinder().axis_C), [-1.0, 1.0])
    assert requirement.grip_axes_C.shape == (0, 3)


def test_a_bore_has_no_type_from_outside_and_three_fingers_from_inside() -> None:
    outside = requirements([cylinder(internal=True)], [OUTSIDE, ACROSS])
    inside = requirements([cylinder(internal=True)], [OUTSIDE, BORE, ACROSS])

    assert isinstance(outside, Rejection)
    assert outside.code == "no-type"
    assert "bore" in outside.detail
    assert not isinstance(inside, Rejection)
    assert [(r.grip, r.opening_width_mm, r.rule) for r in inside] == [(INTERNAL, 25.0, "three_finger_bore")]


def test_a_box_is_held_across_each_pair_of_filled_faces_the_fullest_first() -> None:
    found = requirements([box([0.3, 0.9, 0.0, 1.0, 0.8, 0.8])], [OUTSIDE, ACROSS])

    assert not isinstance(found, Rejection)
    assert [r.opening_width_mm for r in found] == [30.0, 10.0]
    assert all(r.gripper_type == PARALLEL_2 and r.approach_C.shape == (0, 3) for r in found)
    assert np.array_equal(np.concatenate([r.grip_axes_C for r in found]), [[0, 0, 1], [1, 0, 0]])


def test_of_equally_filled_pairs_the_narrower_comes_first() -> None:
    found = requirements([box([1.0] * 6)], [ACROSS])

    assert not isinstance(found, Rejection)
    assert [r.opening_width_mm for r in found] == [10.0, 20.0, 30.0]


@pytest.mark.parametrize(("fraction", "held"), [(0.1, True), (0.0999, False)])
def test_the_least_filled_fraction_is_a_closed_bound(fraction: float, held: bool) -> None:
    found = requirements([box([fraction, fraction, 0, 0, 0, 0])], [ACROSS])

    assert isinstance(found, Rejection) is not held


def test_a_box_of_empty_faces_says_how_empty() -> None:
    found = requirements([box([0.05, 1.0, 0, 0, 0, 0])], [ACROSS])

    assert isinstance(found, Rejection)
    assert found.detail == "no pair of opposite box faces is filled: the best to 5.0 %, at least 10.0 % needed"


def test_a_primitive_that_no_rule_accepts_has_no_type() -> None:
    found = requirements([cylinder()], [ACROSS])

    assert found == Rejection("no-type", "no rule accepts a cylinder")


def test_a_segment_that_no_rule_holds_has_every_refusal_once_by_rule_and_primitive() -> None:
    bore, empty = cylinder(internal=True), box([0.05, 1.0, 0, 0, 0, 0])

    found = requirements([empty, bore, bore], [OUTSIDE, FourFingerCylinder(Params()), ACROSS])

    assert found == Rejection(
        "no-type",
        "two_finger_box on the box: no pair of opposite box faces is filled: the best to 5.0 %, at least 10.0 % needed; "
        "three_finger_cylinder on the cylinder and four_finger_cylinder on the cylinder: the cylinder of diameter "
        "25.00 mm is a bore, held from inside only",
    )


def test_what_another_primitive_of_the_segment_is_asked_for_leaves_no_refusal() -> None:
    found = requirements([box([0.0] * 6), cylinder()], [OUTSIDE, ACROSS])

    assert not isinstance(found, Rejection)
    assert [requirement.rule for requirement in found] == ["three_finger_cylinder"]


def test_a_reason_has_room_for_eight_refusals() -> None:
    boxes = [box([0.01 * k, 0, 0, 0, 0, 0]) for k in range(3)]
    bores = [replace(cylinder(internal=True), radius_mm=10.0 + k) for k in range(10)]

    found = requirements([*boxes, *bores], [OUTSIDE])

    assert isinstance(found, Rejection)
    told = found.detail.split("; ")
    assert told[0] == "no rule accepts a box"
    assert len(told) == 9
    assert told[-1] == "3 more refusals"


class AsksForNothing(ThreeFingerCylinder):
    def apply(self, fit: Primitive) -> list[GripRequirement]:
        return []


def test_a_rule_that_answers_nothing_is_told_as_a_refusal() -> None:
    found = requirements([cylinder()], [AsksForNothing(Params())])

    assert found == Rejection("no-type", "asks for nothing, and does not say why")


FOUR_AROUND, SQUARE = FourFingerCylinder(Params()), FourFingerBox(FourFingerBoxSettings())


def bar(sides: tuple[float, float], filled: list[float] | None = None) -> Box:
    """30 long along x."""
    extents = np.array([30.0, *sides])
    return Box(X_CB=np.eye(4), extents_mm=extents, filled=np.array(filled or [1.0] * 6), filled_min=0.1, rms_mm=0.0)


def test_four_fingers_may_be_asked_for_a_cylinder_beside_three() -> None:
    found = requirements([cylinder()], [OUTSIDE, FOUR_AROUND])

    assert not isinstance(found, Rejection)
    assert [(r.gripper_type, r.opening_width_mm, r.rule) for r in found] == [
        (CENTRIC_3, 25.0, "three_finger_cylinder"),
        (CENTRIC_4, 25.0, "four_finger_cylinder"),
    ]


def test_a_square_box_is_held_by_four_fingers_along_the_axis_of_its_square_section() -> None:
    found = requirements([bar((12.0, 12.06))], [SQUARE])

    assert not isinstance(found, Rejection)
    [requirement] = found
    assert (requirement.gripper_type, requirement.grip) == (CENTRIC_4, EXTERNAL)
    assert requirement.opening_width_mm == pytest.approx(12.03)
    assert np.array_equal(requirement.approach_C, [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


def test_a_cube_may_be_held_by_four_fingers_along_each_axis_the_fullest_first() -> None:
    found = requirements([bar((30.0, 30.0), [0.5, 1, 1, 1, 1, 1])], [SQUARE])

    assert not isinstance(found, Rejection)
    assert [np.abs(r.approach_C[0]).argmax() for r in found] == [0, 1, 2]


@pytest.mark.parametrize(
    ("fit", "why"),
    [
        (bar((12.0, 12.1)), "no section of the box is square: its sides differ by 0.100 mm, at most 0.08 mm"),
        (
            bar((12.0, 12.0), [1, 1, 0.05, 1, 1, 1]),
            "no section of the box is square: its sides differ by 18.000 mm, at most 0.08 mm",
        ),
        (
            bar((12.0, 12.0), [1, 1, 0.05, 1, 0, 1]),
            "no four box faces around an axis are filled: the best to 5.0 %, at least 10.0 % needed",
        ),
    ],
)
def test_a_box_without_four_filled_sides_of_a_square_says_so(fit: Box, why: str) -> None:
    assert requirements([fit], [SQUARE]) == Rejection("no-type", why)
