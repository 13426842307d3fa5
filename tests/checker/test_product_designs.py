"""What the command line designs keeps every promise, judged by a program that shares no code with it."""

import json
from typing import Any

import pytest

from checker.promises import check_design
from designed_products import COMPLETE, PAPER, PUMP, shared_package

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def test_the_sample_is_designed_completely_and_keeps_every_promise(designed: Any) -> None:
    code, design = designed(PUMP)
    assert (code, check_design(design, PUMP)) == (COMPLETE, [])


def test_the_sample_with_the_papers_settings_keeps_every_promise_but_leaving(designed: Any) -> None:
    code, design = designed(PUMP, PAPER)
    assert (code, check_design(design, PUMP, release_clearance=0.0)) == (COMPLETE, [])


@pytest.mark.parametrize("name", ["industreal-gears", "counter-plate-screws", "as1", "bolt-nut-m16"])
def test_a_design_of_public_models_keeps_every_promise(name: str, designed: Any) -> None:
    package = shared_package(name)
    code, design = designed(package)
    status = json.loads((design / "design.json").read_text())["status"]
    assert (code == COMPLETE) == (status == "complete")
    assert check_design(design, package) == []
