"""The catalogue of actuators: totals, defaults, and what may be chosen."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gripwright.design.catalogue import (
    PAPER_ACTUATORS,
    actuators_from_csv,
    body_size,
    envelope_ladder,
    jaw_offset_mm,
    opening_reference_mm,
    opening_within_mm,
    palm_envelope_mm,
    select,
    why_not,
)
from gripwright.domain.errors import InvalidPlan
from gripwright.domain.gripper import Actuator
from gripwright.store.seed import seed_actuators

CSV = Path(__file__).resolve().parents[3] / "shared" / "data" / "actuators.csv"
HEADER = (
    "maker,model,type,fingers,stroke_mm,stroke_basis,opening_min_mm,opening_max_mm,"
    "grip_force_N,force_basis,mass_g,confidence,note"
)


def make_csv(*rows: str) -> str:
    return "\n".join((HEADER, *rows)) + "\n"


def make_actuator(**figures: Any) -> Actuator:
    return Actuator(**{"maker": "M", "model": "X", "gripper_type": "centric-3", "stroke_mm": 10.0, **figures})


def test_the_seed_is_the_csv_of_public_figures_read_whole() -> None:
    if not CSV.exists() and os.environ.get("CI") != "true":
        pytest.skip(f"{CSV} is not there")

    actuators, faults = actuators_from_csv(CSV.read_text(encoding="utf-8"))

    assert not faults
    assert len(actuators) == 85
    assert actuators == seed_actuators()


def test_every_row_of_the_seed_states_its_source_and_confidence() -> None:
    for actuator in seed_actuators():
        assert actuator.source
        assert actuator.confidence in ("A", "B", "C")


def test_a_stroke_per_jaw_and_one_on_the_diameter_give_the_same_total() -> None:
    (per_jaw, on_diameter), faults = actuators_from_csv(
        make_csv("M,a,centric,3,8,per-jaw,,,,,,A,", "M,b,centric,3,16,diameter,,,,,,A,")
    )

    assert not faults
    assert per_jaw.stroke_mm == on_diameter.stroke_mm == 16.0
    assert (per_jaw.stroke_basis, on_diameter.stroke_basis) == ("per-jaw", "diameter")


@pytest.mark.parametrize(
    ("basis", "fingers", "total", "stated"),
    [
        ("per finger, external grip", 2, 68.0, "per-jaw"),
        ("per jaw, closing", 3, 102.0, "per-jaw"),
        ("sum of jaws, max", 3, 34.0, "total"),
        ("total close grip force", 2, 34.0, "total"),
        ("max (min 3)", 2, 34.0, "unknown"),
    ],
)
def test_grip_force_is_the_sum_over_the_jaws(basis: str, fingers: int, total: float, stated: str) -> None:
    (actuator,), _ = actuators_from_csv(make_csv(f'M,a,parallel,{fingers},10,,,,34,"{basis}",,A,'))

    assert (actuator.grip_force_N, actuator.force_basis) == (total, stated)


def test_what_is_not_known_stays_unknown() -> None:
    (actuator,), _ = actuators_from_csv(make_csv("M,a,parallel,2,,,,,,,,B,"))

    unknown = (actuator.opening_max_mm, actuator.grip_force_N, actuator.mass_kg, actuator.finger_length_max_mm, actuator.price)
    assert unknown == (None,) * 5
    assert actuator.stroke_mm == 0.0


def test_figures_that_a_note_states_are_read() -> None:
    (actuator,), _ = actuators_from_csv(
        make_csv('M,a,parallel,2,85,,,,,,1800,A,"42.5 mm per jaw; max finger 165 mm, 0.5 kg each; body 30x40x78 mm"')
    )

    assert (actuator.finger_length_max_mm, actuator.finger_mass_max_kg) == (165.0, 0.5)
    assert (actuator.body_diameter_mm, actuator.body_length_mm) == (50.0, 78.0)
    assert actuator.stroke_basis == "per-jaw"
    assert actuator.mass_kg == 1.8


def test_a_stroke_that_contradicts_the_opening_range_is_shown_as_a_conflict() -> None:
    (actuator,), faults = actuators_from_csv(make_csv("M,a,parallel,2,20,,0,48,,,,A,checked"))

    assert not faults
    assert actuator.note == "checked; CONFLICT: stroke 20 mm, opening 0 to 48 mm"
    assert actuator.confidence == "C"


def test_an_unquoted_comma_in_a_text_does_not_shift_the_cells() -> None:
    (actuator,), faults = actuators_from_csv("maker,model,type,fingers,source,confidence\nM,a,parallel,2,paper, section 6,A\n")

    assert not faults
    assert (actuator.source, actuator.confidence) == ("paper, section 6", "A")


@pytest.mark.parametrize(
    ("row", "pointer"),
    [
        (",a,parallel,2,10,,,,,,,A,", "/0/maker"),
        ("M,a,parallel,two,10,,,,,,,A,", "/0/fingers"),
        ("M,a,parallel,0,10,,,,,,,A,", "/0/fingers"),
        ("M,a,parallel,2,-1,,,,,,,A,", "/0/stroke_mm"),
        ("M,a,parallel,2,nan,,,,,,,A,", "/0/stroke_mm"),
        ("M,a,parallel,2,1e999,,,,,,,A,", "/0/stroke_mm"),
        ("M,a,parallel,2,10,radius,,,,,,A,", "/0/stroke_basis"),
        ("M,a,parallel,2,10,,9,8,,,,A,", "/0/opening_min_mm"),
        ("M,a,parallel,2,10,,,,,,,D,", "/0/confidence"),
        ("M,a,parallel,2,10,,,,,,,A,x,y", "/0/note"),
    ],
)
def test_a_row_with_a_fault_is_left_out_and_the_fault_named(row: str, pointer: str) -> None:
    actuators, faults = actuators_from_csv(make_csv(row, "M,b,parallel,2,10,,,,,,,A,"))

    assert [actuator.model for actuator in actuators] == ["b"]
    assert [fault.pointer for fault in faults] == [pointer]


def test_a_model_that_stands_twice_is_a_fault() -> None:
    actuators, faults = actuators_from_csv(make_csv(*["M,a,parallel,2,10,,,,,,,A,"] * 2))

    assert (len(actuators), [fault.pointer for fault in faults]) == (1, ["/1/model"])


@pytest.mark.parametrize("text", ["", "maker,model\nM,a\n"])
def test_missing_columns_are_named(text: str) -> None:
    actuators, faults = actuators_from_csv(text)

    assert not actuators
    assert {fault.pointer for fault in faults} >= {"/header/type", "/header/fingers"}


def test_a_conflicting_row_is_used_only_where_it_is_named() -> None:
    seed = seed_actuators()

    chosen = {actuator.name for actuator in select(seed, "all")}

    assert "SMC/MHSL3-32D (as in paper)" not in chosen
    assert "SMC/MHSL3-32D" in chosen
    assert [actuator.name for actuator in select(seed, ["SMC/MHSL3-32D (as in paper)"])] == ["SMC/MHSL3-32D (as in paper)"]


def test_the_papers_air_chucks_have_the_papers_strokes() -> None:
    parallel, centric = select(seed_actuators(), "paper")

    assert (parallel.name, centric.name) == PAPER_ACTUATORS
    assert (parallel.stroke_mm, centric.stroke_mm) == (48.0, 8.0)


def test_an_actuator_without_stroke_is_never_chosen_and_says_why() -> None:
    angular = next(actuator for actuator in seed_actuators() if actuator.gripper_type == "angular-2")

    reason = why_not(angular)

    assert reason is not None
    assert reason.code == "no-stroke"
    assert angular not in select(seed_actuators(), "all")


@pytest.mark.parametrize("names", [["SMC/none"], ["SMC/MHC2-6"], [], "SMC"])
def test_a_name_that_cannot_be_used_is_refused(names: list[str]) -> None:
    with pytest.raises(InvalidPlan):
        select(seed_actuators(), names)


def test_a_body_of_unknown_size_has_the_volume_of_its_mass() -> None:
    diameter, length = body_size(make_actuator(mass_kg=0.37))

    assert np.pi / 4 * diameter**2 * length * 2700e-9 == pytest.approx(0.37)
    assert diameter == length


def test_a_known_body_is_taken_as_it_is() -> None:
    assert body_size(make_actuator(body_diameter_mm=50.0, body_length_mm=78.0, mass_kg=0.3)) == (50.0, 78.0)


def test_the_jaw_offset_carries_the_gripping_surface_from_the_jaws_reference() -> None:
    assert jaw_offset_mm(make_actuator(opening_max_mm=42.0), 61.5) == 9.75


def test_the_opening_reference_is_at_least_the_stroke() -> None:
    assert opening_reference_mm(make_actuator(stroke_mm=95.0, mass_kg=0.1)) == 95.0


def test_the_palm_envelope_grows_with_the_opening_and_holds_the_body() -> None:
    for actuator in seed_actuators():
        envelopes = [palm_envelope_mm(actuator, opening) for opening in np.linspace(0.0, 400.0, 50)]
        assert (np.diff(envelopes) >= 0.0).all()
        assert envelopes[0] >= max(body_size(actuator)[0], opening_reference_mm(actuator)) / 2.0


@pytest.mark.parametrize("opening", [60.0, 125.9, 300.0])
def test_an_opening_fits_within_the_envelope_that_it_needs(opening: float) -> None:
    assert opening_within_mm(palm_envelope_mm(make_actuator(mass_kg=0.1), opening)) == pytest.approx(opening)


@pytest.mark.parametrize("largest", [0.0, 16.0, 16.1, 100.0, 1234.0])
def test_the_ladder_of_envelopes_reaches_the_largest_in_even_steps(largest: float) -> None:
    ladder = envelope_ladder(largest)

    assert ladder[0] == 16.0
    assert ladder[-1] >= largest
    assert len(ladder) == 1 or ladder[-2] < largest
    assert (ladder[1:] / ladder[:-1] == pytest.approx(10**0.1, rel=0.02)) if len(ladder) > 1 else True


def test_the_seed_is_json_in_our_own_terms() -> None:
    path = Path(__file__).parents[2] / "service" / "gripwright" / "store" / "seed" / "actuators.json"

    assert {"maker", "model", "gripper_type", "stroke_mm"} <= set(json.loads(path.read_text(encoding="utf-8"))["actuators"][0])


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_of_a_csv_may_end_as_on_any_system(end):
    actuators, faults = actuators_from_csv(f"maker,model,type,fingers{end}Acme,a,centric,3{end}Acme,b,parallel,2{end}")

    assert faults == ()
    assert [actuator.model for actuator in actuators] == ["a", "b"]


def test_a_cell_that_is_too_long_for_a_csv_is_a_fault_of_its_line():
    actuators, (fault,) = actuators_from_csv("maker,model,type,fingers\nAcme," + "x" * 200_000)

    assert actuators == ()
    assert fault.message.startswith("this is no CSV: line 2: field larger than")
