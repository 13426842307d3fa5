"""Against ten times finer motion steps and ten times finer grasps nothing is withdrawn that was promised on the sample.

The short form: some handles and components. `make bench` asks all of them (`bench_finer.py`).
"""

import json
from typing import Any

import pytest

from checker.fault import Limits
from checker.gripper import Gripper
from checker.handles import check_handle
from checker.package import read_package
from designed_products import PAPER, PUMP, Designed
from finer import FINER, FINER_GRASPS, judged, withdrawn_handles

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
PLANS = {"default": (), "paper": PAPER}
OPERATIONS = ("op-03", "op-08", "op-10", "op-13")  # into the housing, over the shaft, past teeth, over the shaft again


@pytest.mark.parametrize("plan", PLANS)
def test_the_calculation_withdraws_no_handle_with_finer_motions(plan: str, designed: Designed) -> None:
    assert withdrawn_handles(designed(PUMP, PLANS[plan])[1], PUMP) == []


def test_the_checker_finds_nothing_against_handles_with_finer_steps(designed: Designed) -> None:
    folder = designed(PUMP, PAPER)[1]
    document: dict[str, Any] = json.loads((folder / "design.json").read_text())
    package, limits = read_package(PUMP), Limits(release_clearance=0.0, finer=FINER)
    checked, faults = [], []

    for record in document["grippers"]:
        gripper = Gripper.read(folder, record)
        for handle in record["handles"]:
            if handle["operation"] in OPERATIONS:
                faults += check_handle(gripper, handle, package, limits)
                checked.append(handle["operation"])

    assert sorted(checked) == sorted(OPERATIONS)
    assert faults == []


@pytest.mark.parametrize("component", ["flanged-sleeve", "key"])
def test_finer_grasps_keep_every_segment_that_is_held(component: str) -> None:
    usual, finer = judged(PUMP, component, PAPER), judged(PUMP, component, (*PAPER, *FINER_GRASPS))

    assert sum(one.grasps_planned for one in finer) > FINER * sum(one.grasps_planned for one in usual)
    held = {one.segment for one in usual if one.free}
    assert held
    assert held <= {one.segment for one in finer if one.free}
