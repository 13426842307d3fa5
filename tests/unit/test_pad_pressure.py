"""What a grip presses its pads with, against the closed form of a layer that cannot give sideways."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gripwright.design.pad_pressure import pad_compression, pad_warnings
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.grasp import PARALLEL_2, Grasp, Hold
from gripwright.domain.gripper import Handle
from gripwright.domain.pad import Pad

PAD = Pad(thickness_mm=1.5)


def handle(force_N: float, area_mm2: float) -> Handle:
    return Handle(
        operation="op-1",
        component="ring",
        segment=0,
        opening_width_mm=10.0,
        release_opening_mm=11.0,
        grasp=Grasp(X_CG=np.eye(4), gripper_type=PARALLEL_2, grip="external", opening_width_mm=10.0),
        gap_mm=1.0,
        hold=Hold(required_force_N=force_N, moment_Nmm=0.0, symmetry=1.0, contact_area_mm2=area_mm2),
        safety_factor=None,
    )


def cad(*, padded: bool = True) -> GripperCad:
    made: Any = object.__new__(GripperCad)
    object.__setattr__(made, "finger", SimpleNamespace(bonded=SimpleNamespace(bought=None) if padded else None))
    object.__setattr__(made, "spec", SimpleNamespace(pad=PAD))
    return made  # type: ignore[no-any-return]


@pytest.mark.parametrize(("force_N", "area_mm2"), [(100.0, 60.0), (30.0, 5.0)])
def test_a_pad_gives_by_its_pressure_over_its_confined_modulus(force_N: float, area_mm2: float) -> None:
    nu = PAD.poisson
    confined_MPa = PAD.modulus_MPa * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))

    assert pad_compression(handle(force_N, area_mm2), cad()) == pytest.approx(force_N / area_mm2 / confined_MPa)


def test_fingers_without_a_pad_press_none() -> None:
    assert pad_compression(handle(100.0, 60.0), cad(padded=False)) is None


def test_a_pad_pressed_farther_than_rubber_bears_is_warned_of() -> None:
    gripper: Any = SimpleNamespace(id="G1", handles=(handle(10.0, 60.0), handle(600.0, 30.0)))

    (told,) = pad_warnings([gripper], [cad()])

    assert told.startswith("G1, op-1: holding ring presses")
    assert "bears 20 % for long" in told
