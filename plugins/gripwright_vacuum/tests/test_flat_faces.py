"""The planner finds where all of a face lies on flat surface."""

import numpy as np
import pytest
from plates import asked, plate, whole

from gripwright.testing import fake_context
from gripwright_vacuum.flat_faces import FlatFacePlanner, FlatFaceSettings
from gripwright_vacuum.vacuum.hand import VacuumHand, VacuumHandSettings

HAND = VacuumHand(VacuumHandSettings())


def planned(component, width_mm: float, **settings):
    planner = FlatFacePlanner(FlatFaceSettings(**settings))
    return planner.plan(component, whole(component), asked(width_mm), HAND.sized(width_mm), fake_context())


def test_the_first_position_is_over_the_centre_of_mass() -> None:
    first = planned(plate(), 32.0)[0]

    assert np.allclose(first.X_CG[:3, 3], [0.0, 0.0, 0.0], atol=1e-6)
    assert np.allclose(first.X_CG[:3, 2], [0.0, 0.0, -1.0])


def test_a_hole_in_the_middle_is_avoided_by_the_cup_and_its_rim() -> None:
    found = planned(plate((0.0, 0.0, 10.0)), 20.0, rim=1.0)

    off = [float(np.hypot(*grasp.X_CG[:2, 3])) for grasp in found]
    assert off[0] == pytest.approx(10.0 + 10.0 + 1.0, abs=0.05)
    assert off == sorted(off)


def test_no_cup_hangs_over_an_edge() -> None:
    found = planned(plate(), 50.0, rim=2.0, positions_max=10_000, step=3.0)

    at = np.abs([grasp.X_CG[:2, 3] for grasp in found])
    assert len(found) > 50
    assert at[:, 0].max() <= 60.0 - 27.0 + 1e-6
    assert at[:, 1].max() <= 40.0 - 27.0 + 1e-6


def test_a_face_that_no_area_has_room_for_has_no_position() -> None:
    assert planned(plate(), 80.0) == []
    assert planned(plate((-30.0, 0.0, 15.0), (0.0, 0.0, 15.0), (30.0, 0.0, 15.0)), 40.0) == []


def test_only_directions_that_the_requirement_allows_are_planned() -> None:
    assert {tuple(np.round(grasp.X_CG[:3, 2], 6)) for grasp in planned(plate(), 5.0)} == {(0.0, 0.0, -1.0)}
