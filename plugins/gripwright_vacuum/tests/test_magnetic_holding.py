"""What a magnet holds: only what is ferrous, and thick enough for its flux."""

import math

import pytest
from plates import hanging, on_top, plate

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import Hold
from gripwright.geometry.held_surface import Surface
from gripwright.testing import fake_context
from gripwright_vacuum.gripper_types import MAGNETIC_1
from gripwright_vacuum.magnetic.hand import MagneticHand, MagneticHandSettings
from gripwright_vacuum.magnetic.holding import MagneticHolding, MagneticSettings

HAND, CTX = MagneticHand(MagneticHandSettings()), fake_context()
MODEL = MagneticHolding(MagneticSettings())


def held(component) -> Hold | Rejection:
    grasp = on_top(width_mm=20.0, gripper_type=MAGNETIC_1)
    contacts = MODEL.contacts(grasp, Surface(component.mesh), HAND, 40.0, CTX)
    return contacts if isinstance(contacts, Rejection) else MODEL.hold(grasp, contacts, hanging(0.5), component, CTX)


@pytest.mark.parametrize(("ferrous", "says"), [(None, "is not said to be `ferrous`"), (False, "is not ferrous")])
def test_what_is_not_known_to_be_ferrous_is_held_by_no_magnet(ferrous, says: str) -> None:
    answer = held(plate(ferrous=ferrous))

    assert isinstance(answer, Rejection)
    assert answer.code == "not-held"
    assert says in answer.detail


@pytest.mark.parametrize(("thickness", "carried"), [(20.0, 1.0), (5.0, 1.0), (2.5, 0.5), (1.0, 0.2)])
def test_a_plate_thinner_than_a_quarter_of_the_pole_carries_less_flux(thickness: float, carried: float) -> None:
    thick, found = held(plate(ferrous=True, thickness_mm=30.0)), held(plate(ferrous=True, thickness_mm=thickness))

    assert isinstance(thick, Hold)
    assert isinstance(found, Hold)
    assert found.contact_area_mm2 == pytest.approx(carried * math.pi / 4.0 * 20.0**2, rel=1e-3)
    assert found.required_force_N == pytest.approx(thick.required_force_N / carried, rel=1e-3)


def test_a_pole_over_a_hole_does_not_touch() -> None:
    assert isinstance(held(plate((0.0, 0.0, 3.0), ferrous=True)), Rejection)
