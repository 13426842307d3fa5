"""What a suction cup holds: figures by hand."""

import math

import numpy as np
import pytest
from plates import hanging, on_top, plate

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import Grasp, Hold
from gripwright.domain.gripper import NO_STROKE, Actuator
from gripwright.geometry.held_surface import SEAT_MM, Surface
from gripwright.testing import fake_context
from gripwright_vacuum.gripper_types import VACUUM_1
from gripwright_vacuum.vacuum.hand import VacuumHand, VacuumHandSettings
from gripwright_vacuum.vacuum.holding import VacuumHolding, VacuumSettings

HAND = VacuumHand(VacuumHandSettings())
CTX = fake_context()
PLAIN = VacuumSettings(effective=1.0)


def touching(component, grasp, params: VacuumSettings = PLAIN):
    return VacuumHolding(params).contacts(grasp, Surface(component.mesh), HAND, 40.0, CTX)


def held(component, load, *, at=(0.0, 0.0), width_mm: float = 32.0, params: VacuumSettings = PLAIN) -> Hold:
    grasp = on_top(*at, width_mm=width_mm)
    contacts = touching(component, grasp, params)
    assert not isinstance(contacts, Rejection)
    found = VacuumHolding(params).hold(grasp, contacts, load, component, CTX)
    assert isinstance(found, Hold)
    return found


def test_a_plate_over_its_centre_asks_for_pull_and_shear_together() -> None:
    """An acceleration a at the angle φ asks for F = m·(g + a·cos φ + a·sin φ / μ), at most m·(g + a·√(1 + 1/μ²))."""
    found = held(plate(texture="smooth", friction=0.5), hanging(1.0))

    exact = 9.81 + 5.0 * math.hypot(1.0, 1.0 / 0.5)
    assert exact * 0.98 <= found.required_force_N <= exact + 1e-9


def test_a_centre_of_mass_aside_peels_the_lip() -> None:
    """Core of a thin ring: half its radius. Weight and acceleration straight down, 20 mm aside: F = m·(g + a)·(1 + 20 / 8)."""
    found = held(plate(texture="smooth", friction=100.0), hanging(1.0, centroid=(20.0, 0.0, 0.0)))

    exact = (9.81 + 5.0) * (1.0 + 20.0 / 8.0)
    assert found.required_force_N == pytest.approx(exact, rel=0.02)


def test_the_insertion_force_presses_and_asks_for_nothing() -> None:
    without, pressed = (held(plate(friction=0.5), hanging(1.0, force_N=force)) for force in (0.0, 500.0))

    assert pressed.required_force_N == pytest.approx(without.required_force_N)


@pytest.mark.parametrize(
    ("texture", "factor"), [("smooth", 1.0), ("machined", 1.15), ("rough", 1.5), ("porous", 3.0), (None, 1.15)]
)
def test_rougher_surfaces_leak_more(texture, factor: float) -> None:
    smooth = held(plate(texture="smooth"), hanging(1.0)).required_force_N

    assert held(plate(texture=texture), hanging(1.0)).required_force_N == pytest.approx(factor * smooth)


def test_vacuum_acts_within_the_lip_alone() -> None:
    wide, narrow = (held(plate(friction=100.0), hanging(1.0), params=VacuumSettings(effective=share)) for share in (1.0, 0.8))

    assert narrow.required_force_N == pytest.approx(wide.required_force_N / 0.64, rel=1e-6)
    assert narrow.contact_area_mm2 == pytest.approx(0.64 * math.pi / 4.0 * 32.0**2)


@pytest.mark.parametrize(
    ("component", "at"),
    [(plate((0.0, 0.0, 2.0)), (0.0, 0.0)), (plate((0.0, 0.0, 2.0)), (17.0, 0.0)), (plate(), (50.0, 0.0)), (plate(), (0.0, 24.5))],
)
def test_a_cup_over_a_hole_or_an_edge_does_not_seal(component, at) -> None:
    answer = touching(component, on_top(*at))

    assert isinstance(answer, Rejection)
    assert answer.code == "no-contact"


def test_a_cup_beside_a_hole_seals() -> None:
    assert not isinstance(touching(plate((0.0, 0.0, 2.0)), on_top(18.1, 0.0)), Rejection)


@pytest.mark.parametrize("off_mm", [-0.3, 0.0, 0.3])
def test_a_cup_is_seated_just_off_the_surface(off_mm: float) -> None:
    seated = VacuumHolding(PLAIN).seat(on_top(10.0, 5.0, off_mm=off_mm), Surface(plate().mesh), HAND, CTX)

    assert isinstance(seated, Grasp)
    assert np.allclose(seated.X_CG[:3, 3], [10.0, 5.0, SEAT_MM], atol=1e-9)


def test_nothing_is_seated_where_there_is_no_surface() -> None:
    assert isinstance(VacuumHolding(PLAIN).seat(on_top(200.0), Surface(plate().mesh), HAND, CTX), Rejection)


@pytest.mark.parametrize(("opening_max", "force", "expected"), [(50.0, 100.0, 25.0), (None, 100.0, None), (50.0, None, None)])
def test_suction_goes_by_the_area_of_the_cup(opening_max, force, expected) -> None:
    actuator = Actuator(
        maker="M",
        model="E",
        gripper_type=VACUUM_1,
        stroke_mm=0.0,
        stroke_basis=NO_STROKE,
        opening_max_mm=opening_max,
        grip_force_N=force,
    )

    assert VacuumHolding(PLAIN).grip_force_N(actuator, 25.0) == expected
