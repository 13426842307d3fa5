"""The paper's own figures, computed by the whole pipeline from the sample's CAD."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from designed_products import COMPLETE, PAPER, PUMP, Designed
from gripwright.domain.shape import FloatArray

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
GOLDEN = json.loads((Path(__file__).parent / "paper-grippers.json").read_text())["grippers"]
OPENING_MM = 0.1
PLANS = {"default": (), "paper": PAPER}
TIPS_MM = 3.0 + 0.25  # min_contact and axial.contact_reserve: how far the tips reach below the edge of what they hold
MARGIN_MM = 0.1


@pytest.fixture(scope="session")
def paper_design(designed: Designed) -> dict[str, Any]:
    code, folder = designed(PUMP, PAPER)
    assert code == COMPLETE
    document: dict[str, Any] = json.loads((folder / "design.json").read_text())
    return document


def test_the_sample_needs_the_papers_four_grippers(paper_design: dict[str, Any]) -> None:
    found = sorted(
        (gripper["gripper_type"], gripper["opening_min"], gripper["opening_max"], gripper["finger_length"])
        for gripper in paper_design["grippers"]
    )

    assert [(row[0], row[3]) for row in found] == [(row[0], row[3]) for row in sorted(map(tuple, GOLDEN))]
    for row, golden in zip(found, sorted(map(tuple, GOLDEN)), strict=True):
        assert row[1:3] == pytest.approx(golden[1:3], abs=OPENING_MM)
    assert paper_design["optimum"]["proven"]


def test_the_rotor_is_held_by_its_fourth_segment_alone(paper_design: dict[str, Any]) -> None:
    rotor = next(component for component in paper_design["components"] if component["id"] == "rotor")

    assert len(rotor["segments"]) == 6
    graspable = [segment for segment in rotor["segments"] if segment["graspable"]]
    assert [round(segment["opening_width"], 1) for segment in graspable] == [60.5]
    assert sum(segment["primitive"]["kind"] == "box" for segment in rotor["segments"]) == 1  # the vanes: nothing cylindrical
    assert all(segment["detail"] for segment in rotor["segments"] if not segment["graspable"])


@pytest.mark.parametrize("plan", PLANS)
def test_the_rotors_segment_that_is_held_is_the_fourth_from_its_tip(plan: str, designed: Designed) -> None:
    """As the paper counts: shaft end, neck, vanes, the held cylinder, neck, collar. The CAD has its tip at the greatest z."""
    rotor = component(designed(PUMP, PLANS[plan])[1], "rotor")
    fitted = [segment for segment in rotor["segments"] if segment["primitive"] is not None]

    from_tip = sorted(fitted, key=lambda segment: -segment["primitive"]["center"][2])

    assert [segment["graspable"] for segment in from_tip] == [False, False, False, True, False, False]


def test_the_inner_sleeve_is_two_cylinders_held_by_the_second_with_long_fingers(paper_design: dict[str, Any]) -> None:
    sleeve = next(component for component in paper_design["components"] if component["id"] == "inner-sleeve")

    assert [segment["primitive"]["kind"] for segment in sleeve["segments"]] == ["cylinder", "cylinder"]
    (held,) = [segment for segment in sleeve["segments"] if segment["graspable"]]
    assert held["opening_width"] == pytest.approx(22.0, abs=OPENING_MM)
    assert held["finger_length_min"] > 24.0  # past the first segment, 24 mm high


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize(
    ("name", "radius_mm", "axis_mm", "tallest"),
    [
        ("rotor", 30.25, (0.0, 0.0), "rotor"),  # No. 3: past its own neck and collar
        ("inner-sleeve", 11.0, (-220.0, 0.0), "inner-sleeve"),  # No. 5: past its first segment
        ("sleeve", 9.5, (-220.0, 0.0), "shaft"),  # No. 8: the shaft, No. 6, stands out above it
        ("gear", 26.5, (220.0, 0.0), "gear"),  # No. 10: past its own teeth to the flange
        ("flanged-sleeve", 7.0, (-220.0, 0.0), "shaft"),  # No. 13: the shaft again
    ],
)
def test_a_finger_is_at_least_as_long_as_two_heights_of_the_cad_differ(
    plan: str, name: str, radius_mm: float, axis_mm: tuple[float, float], tallest: str, designed: Designed
) -> None:
    """L⁻ by hand: from the tips, `TIPS_MM` below the upper edge of the held cylinder, to what stands highest under the palm.

    Both heights are those of vertices of the placed meshes: the edge is the highest vertex at the cylinder's radius. The palm,
    wider than all of these, needs the margin above the highest vertex of `tallest`. At other depths L⁻ is greater.
    """
    around = np.linalg.norm(placed(name)[:, :2] - axis_mm, axis=1)
    edge_mm = placed(name)[around > radius_mm - 0.05, 2].max()
    by_hand_mm = placed(tallest)[:, 2].max() + MARGIN_MM - (edge_mm - TIPS_MM)

    (held,) = [segment for segment in component(designed(PUMP, PLANS[plan])[1], name)["segments"] if segment["graspable"]]

    assert held["opening_width"] == pytest.approx(2.0 * radius_mm, abs=OPENING_MM)
    assert held["finger_length_min"] == pytest.approx(by_hand_mm, abs=0.02)


def test_the_gears_fingers_are_longer_than_its_teeth(paper_design: dict[str, Any]) -> None:
    """The paper, section 5.2: "the finger should be longer than the depth of the gear teeth to contact the target segment"."""
    gear = placed("gear")
    around = np.linalg.norm(gear[:, :2] - (220.0, 0.0), axis=1)
    teeth = gear[(around > 24.0) & (around < 26.4), 2]  # between root and tip, above the flange

    (held,) = [
        segment
        for entry in paper_design["components"]
        if entry["id"] == "gear"
        for segment in entry["segments"]
        if segment["graspable"]
    ]

    assert held["finger_length_min"] > np.ptp(teeth) + 3.0  # and along the least contact


def test_the_same_package_and_plan_give_the_same_design_but_for_times_whatever_else_is_installed(designed: Designed) -> None:
    folders = [designed(PUMP, PAPER)[1], designed(PUMP, PAPER, again=1, examples=True)[1]]

    first, second = (
        {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()} for folder in folders
    )

    assert first.keys() == second.keys()
    for path in first:
        if path.name == "design.json":
            documents = [json.loads(files[path]) for files in (first, second)]
            assert [document.pop("timings") for document in documents]
            assert documents[0] == documents[1]
        else:
            assert first[path] == second[path], path


def component(folder: Path, name: str) -> dict[str, Any]:
    """What the design says of a component."""
    document = json.loads((folder / "design.json").read_text())
    found: dict[str, Any] = next(entry for entry in document["components"] if entry["id"] == name)
    return found


def placed(name: str) -> FloatArray:
    """The vertices of a component in its place in the product, (n, 3)."""
    product = json.loads((PUMP / "product.json").read_text())
    entry = next(entry for entry in product["components"] if entry["id"] == name)
    mesh = trimesh.load_mesh(PUMP / entry["file"])
    return np.asarray(mesh.apply_transform(np.array(entry["pose"])).vertices)
