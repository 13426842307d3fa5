"""The paper's own figures, computed by the whole pipeline from the sample's CAD."""

import json
from pathlib import Path
from typing import Any

import pytest

from designed_products import COMPLETE, PAPER, PUMP, Designed

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
GOLDEN = json.loads((Path(__file__).parent / "paper-grippers.json").read_text())["grippers"]
OPENING_MM = 0.1


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


def test_the_inner_sleeve_is_two_cylinders_held_by_the_second_with_long_fingers(paper_design: dict[str, Any]) -> None:
    sleeve = next(component for component in paper_design["components"] if component["id"] == "inner-sleeve")

    assert [segment["primitive"]["kind"] for segment in sleeve["segments"]] == ["cylinder", "cylinder"]
    (held,) = [segment for segment in sleeve["segments"] if segment["graspable"]]
    assert held["opening_width"] == pytest.approx(22.0, abs=OPENING_MM)
    assert held["finger_length_min"] > 24.0  # past the first segment, 24 mm high


def test_the_same_package_and_plan_give_the_same_design_but_for_times(designed: Designed) -> None:
    folders = [designed(PUMP, PAPER, again=run)[1] for run in (0, 1)]

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
