"""Cups with holders and pole shoes: what is made and what is bought."""

from dataclasses import replace

import numpy as np
import pytest

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import NO_STROKE, Actuator, FingerDesign, FingerSpec
from gripwright.geometry import brep
from gripwright.testing import fake_context
from gripwright_vacuum.gripper_types import MAGNETIC_1, VACUUM_1
from gripwright_vacuum.magnetic.finger import PoleShoe
from gripwright_vacuum.magnetic.hand import MagneticHand, MagneticHandSettings
from gripwright_vacuum.vacuum.cup import STANDARD_MM, CupMeasures
from gripwright_vacuum.vacuum.finger import SuctionCup, SuctionCupSettings
from gripwright_vacuum.vacuum.hand import VacuumHand, VacuumHandSettings

CUP, SHOE = SuctionCup(SuctionCupSettings()), PoleShoe(PoleShoe.params_model())


def spec(gripper_type: str, width_mm: float, length_mm: float = 60.0) -> FingerSpec:
    actuator = Actuator(
        maker="M", model="A", gripper_type=gripper_type, stroke_mm=0.0, stroke_basis=NO_STROKE, opening_max_mm=80.0
    )
    return FingerSpec(
        gripper_type=gripper_type,
        grip=SURFACE,
        finger_length_mm=length_mm,
        jaw_offset_mm=0.0,
        opening_min_mm=width_mm,
        opening_max_mm=width_mm,
        stroke_mm=0.0,
        fingers=1,
        envelope_mm=63.0,
        actuator=actuator,
        contact_radii_mm=(),
        grip_force_N=60.0,
    )


@pytest.mark.parametrize("width_mm", STANDARD_MM)
def test_every_cup_stands_within_its_hand_with_air_all_through(width_mm: float) -> None:
    made = CUP.design(spec(VACUUM_1, width_mm), fake_context())

    assert isinstance(made, FingerDesign)
    assert made.bonded is not None
    hand = VacuumHand(VacuumHandSettings()).sized(width_mm)
    room = np.concatenate([solid.vertices_mm for solid in hand.finger(60.0, SURFACE)])
    stem = made.mesh.vertices_mm[made.mesh.vertices_mm[:, 2] > -59.9]
    assert (stem.min(axis=0) >= room.min(axis=0) - 1e-6).all()
    assert (stem.max(axis=0) <= room.max(axis=0) + 1e-6).all()
    air = brep.cylinder_z(0.0, 0.0, CupMeasures(diameter_mm=width_mm).thread.bore_radius_mm * 0.99, -90.0, 0.0)
    assert brep.measure(brep.common(brep.read_brep(made.brep), air)).volume_mm3 == pytest.approx(0.0, abs=1e-6)
    assert brep.bounds_mm(brep.read_brep(made.bonded.pad.brep))[1, 2] == pytest.approx(0.0, abs=1e-6)


def test_the_cup_is_bought_and_the_holder_is_made() -> None:
    made = CUP.design(spec(VACUUM_1, 32.0), fake_context())

    assert isinstance(made, FingerDesign)
    assert made.bonded is not None
    assert made.bonded.bought is not None
    assert made.bonded.bought.designation == "flat suction cup 32 mm, NBR, G1/8 male"
    assert made.bought is not None
    assert [part.item for part in made.bought] == ["screw", "O-ring"]
    assert made.name == "cup holder"


def test_a_stem_too_short_for_cup_and_stud_is_refused() -> None:
    least = CupMeasures(diameter_mm=50.0).length_min_mm

    assert isinstance(CUP.design(spec(VACUUM_1, 50.0, least), fake_context()), FingerDesign)
    refused = CUP.design(spec(VACUUM_1, 50.0, least - 0.1), fake_context())
    assert isinstance(refused, Rejection)
    assert refused.code == "finger-too-short"


@pytest.mark.parametrize(("designer", "gripper_type"), [(CUP, VACUUM_1), (SHOE, MAGNETIC_1)])
def test_an_actuator_without_room_for_the_flange_is_refused(designer, gripper_type: str) -> None:
    refused = designer.design(replace(spec(gripper_type, 32.0), envelope_mm=10.0), fake_context())

    assert isinstance(refused, Rejection)
    assert refused.code == "base-outside-envelope"


def test_a_pole_shoe_is_mild_steel_as_wide_as_its_face() -> None:
    made = SHOE.design(spec(MAGNETIC_1, 32.0, 20.0), fake_context())

    assert isinstance(made, FingerDesign)
    assert made.bonded is None
    front = made.mesh.vertices_mm[made.mesh.vertices_mm[:, 2] > -19.9]
    assert 2.0 * np.hypot(front[:, 0], front[:, 1]).max() == pytest.approx(32.0, abs=1e-6)
    assert np.pi * 16.0**2 * 20.0 < made.volume_mm3
    hand = MagneticHand(MagneticHandSettings()).sized(32.0)
    assert hand.finger_length_min_mm() < 20.0
