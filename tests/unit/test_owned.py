"""Grippers that are at hand, from the plan to the answer."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gripwright.design import pipeline
from gripwright.design.catalogue import palm_envelope_mm
from gripwright.design.gripper_set import minimise
from gripwright.design.impact import change_impact
from gripwright.design.miss_document import tip_document
from gripwright.design.owned import actuators_of, owned_grippers, specifications
from gripwright.design.plan import plan_of
from gripwright.design.result import DesignResult
from gripwright.domain.assembly import AssemblyTask, Component, Operation
from gripwright.domain.errors import InvalidPlan
from gripwright.domain.grasp import CENTRIC_3, PARALLEL_2
from gripwright.domain.gripper import Actuator
from gripwright.geometry import brep
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer, SetCoverParams
from here_runner import HereRunner

PAPER_WIDTHS = Path(__file__).resolve().parents[3] / "shared" / "data" / "paper-widths.json"


def make_actuator(**figures: Any) -> Actuator:
    figures = {"maker": "M", "model": "a", "gripper_type": CENTRIC_3, "stroke_mm": 10.0, "grip_force_N": 200.0, **figures}
    return Actuator(**{"opening_max_mm": 40.0, "mass_kg": 0.4, **figures})


def make_owned(**fields: Any) -> dict[str, Any]:
    owned = {"name": "old", "gripper_type": CENTRIC_3, "opening_min": 15.0, "opening_max": 25.0, "finger_length": 40.0}
    return {**owned, **fields}


def make_task(radii_mm: Sequence[float] = (10.0, 30.0)) -> AssemblyTask:
    """Two pegs of those radii, each set down alone."""
    down = np.stack([np.eye(4)] * 2)
    down[0, 2, 3] = 100.0
    pegs = [brep.tessellate(brep.cylinder_z(0.0, 0.0, radius, 0.0, 60.0)) for radius in radii_mm]
    return AssemblyTask(
        part_number="P",
        revision="A",
        name="",
        components=tuple(
            Component(id=name, mesh=mesh, X_PC=np.eye(4), density_kg_m3=500.0) for name, mesh in zip("ab", pegs, strict=True)
        ),
        obstacles=(),
        operations=tuple(Operation(id=f"op-{name}", active=(name,), passive=(), motion=down) for name in "ab"),
    )


def design(
    owned: Sequence[Mapping[str, Any]], task: AssemblyTask | None = None, actuators: Sequence[Actuator] = ()
) -> tuple[DesignResult, list[str]]:
    plan = plan_of({"owned": owned})
    runner = HereRunner(plan, build_toolbox(plan, load_registry()))
    result: DesignResult = runner.get(pipeline.design(task or make_task(), actuators or [make_actuator()], plan, runner))
    return result, runner.ran


@pytest.fixture(scope="module")
def first() -> DesignResult:
    return design([])[0]


def test_a_design_with_all_grippers_of_an_earlier_one_makes_and_buys_nothing(first: DesignResult) -> None:
    assert (first.document["status"], first.document["optimum"]["new"]) == ("complete", 2)

    again, ran = design(specifications(first.document))

    assert (again.document["status"], again.document["optimum"]["new"]) == ("complete", 0)
    assert [gripper["owned"] for gripper in again.document["grippers"]] == ["P-A-G1", "P-A-G2"]
    assert [(row.make_or_buy, row.part_number) for row in again.bom] == [("owned", "P-A-G1"), ("owned", "P-A-G2")]
    assert again.cads == (None, None)
    assert "fingers" not in ran
    for old, new in zip(first.document["grippers"], again.document["grippers"], strict=True):
        for key in ("opening_min", "opening_max", "finger_length", "palm_radius"):
            assert new[key] == old[key]
        assert (new["files"], new["finger"]) == ({}, None)
        assert all(handle["verified"] for handle in new["handles"])


def test_grippers_with_concave_tips_cannot_be_taken_over(first: DesignResult) -> None:
    one, two = first.document["grippers"]
    hollow = {**first.document, "grippers": [one, {**two, "finger": {**two["finger"], "groove_radius_mm": 20.0}}]}

    with pytest.raises(InvalidPlan, match="G2"):
        specifications(hollow)


def test_what_no_owned_gripper_holds_gets_a_new_one(first: DesignResult) -> None:
    owned = specifications(first.document)[:1]

    again, _ = design(owned)

    assert (again.document["status"], again.document["optimum"]["new"]) == ("complete", 1)
    assert [gripper["owned"] for gripper in again.document["grippers"]] == ["P-A-G1", None]
    assert {row.make_or_buy for row in again.bom if row.gripper == "G2"} == {"buy", "make"}


def test_a_change_of_one_component_names_its_operation_and_its_gripper_and_no_others(first: DesignResult) -> None:
    again, _ = design(specifications(first.document), make_task(radii_mm=(10.0, 42.0)))

    impact = change_impact(first.document, again.document)

    assert [(op["id"], op["outcome"], op["before"], op["after"]) for op in impact["operations"]] == [
        ("op-a", "held", "P-A-G1", "P-A-G1"),
        ("op-b", "other_gripper", "P-A-G2", "G2"),
    ]
    assert [(item["id"], item["holds"], item["no_longer_holds"]) for item in impact["grippers"]] == [
        ("G1", ["op-a"], []),
        ("G2", [], ["op-b"]),
    ]
    assert impact["new_grippers"] == ["G2"]
    assert [(item["id"], item["outcome"]) for item in impact["components"]] == [("a", "unchanged"), ("b", "changed")]


def test_a_change_within_the_stroke_leaves_every_operation_held(first: DesignResult) -> None:
    again, _ = design(specifications(first.document), make_task(radii_mm=(10.0, 28.5)))

    impact = change_impact(first.document, again.document)

    assert [op["outcome"] for op in impact["operations"]] == ["held", "held"]
    assert (impact["new_grippers"], impact["grippers"][1]["holds"]) == ([], ["op-b"])


def test_operations_and_components_that_come_and_go_are_named(first: DesignResult) -> None:
    document = {**first.document, "operations": first.document["operations"][:1], "components": first.document["components"][:1]}

    gone, come = change_impact(first.document, document), change_impact(document, first.document)

    assert [op["outcome"] for op in gone["operations"]][1:] == ["removed"]
    assert [op["outcome"] for op in come["operations"]][1:] == ["added"]
    assert [item["outcome"] for item in gone["components"]] == ["unchanged", "removed"]
    assert [item["outcome"] for item in come["components"]] == ["unchanged", "added"]


def test_three_of_the_papers_four_grippers_at_hand_leave_one_to_make() -> None:
    if not PAPER_WIDTHS.exists() and os.environ.get("CI") != "true":
        pytest.skip(f"{PAPER_WIDTHS} is not there")
    document = json.loads(PAPER_WIDTHS.read_text(encoding="utf-8"))
    problem = {
        key: document[key] for key in ("strokes", "release_clearance", "finger_length_step", "components") if key in document
    }
    optimizer: Any = SetCoverOptimizer(SetCoverParams())
    figures = ("gripper_type", "opening_min", "opening_max", "finger_length")
    published = [{key: gripper[key] for key in figures} for gripper in minimise(problem, optimizer)["grippers"]]
    assert len(published) == 4

    for missing in range(4):
        owned = published[:missing] + published[missing + 1 :]
        assert minimise({**problem, "owned": owned}, optimizer)["new"] == 1


def test_an_owned_gripper_has_its_own_figures_and_those_of_its_actuator() -> None:
    hands: Any = {CENTRIC_3: CentricHand(CentricSettings())}
    plan = plan_of({"owned": [make_owned(actuator="M/a"), make_owned(name="plain", palm_radius=33.0)]})

    named, plain = owned_grippers(plan.owned, [make_actuator()], hands)

    assert (named.id, named.fingers, named.finger_length_mm) == ("old", 3, 40.0)
    assert named.opening_min_mm == pytest.approx(15.0, abs=5e-5)
    assert named.opening_max_mm == pytest.approx(25.0, abs=5e-5)
    assert named.envelope_mm == pytest.approx(palm_envelope_mm(make_actuator(), 25.0))
    assert (plain.actuator.grip_force_N, plain.actuator.stroke_mm, plain.envelope_mm) == (None, 10.0, 33.0)


@pytest.mark.parametrize(
    "tips", [{}, {"taper": -8.0}, {"v_angle": 120.0, "v_depth": 3.0}, {"taper": 8.0, "v_angle": 90.0, "v_depth": 2.5}]
)
def test_the_tips_of_an_earlier_designs_gripper_are_those_of_the_owned_one(tips: dict[str, float]) -> None:
    hands: Any = {PARALLEL_2: ParallelHand(HandSettings())}
    gripper = {
        **make_owned(gripper_type=PARALLEL_2), "id": "G1", "grip": "external", "palm_radius": 33.0, "owned": None, **tips,
        "actuator": {"maker": "M", "model": "a"},
    }  # fmt: skip
    plan = plan_of({"owned": specifications({"product": {"part_number": "P", "revision": "A"}, "grippers": [gripper]})})

    (owned,) = owned_grippers(plan.owned, [make_actuator(gripper_type=PARALLEL_2)], hands)

    assert tip_document(owned.taper_rad, owned.vee) == tips


def test_owned_grippers_that_cannot_be_are_refused_together() -> None:
    plan = plan_of({"owned": [make_owned(actuator="M/b"), make_owned(name="wide", actuator="M/a", opening_max=40.0)]})

    with pytest.raises(InvalidPlan) as refused:
        actuators_of(plan.owned, [make_actuator()])

    assert [fault.pointer for fault in refused.value.faults] == ["/options/owned/0/actuator", "/options/owned/1/opening_max"]


def test_an_owned_gripper_without_a_hand_model_is_refused() -> None:
    plan = plan_of({"owned": [make_owned(gripper_type="vacuum-1")]})

    with pytest.raises(InvalidPlan) as refused:
        owned_grippers(plan.owned, [], {})

    assert refused.value.faults[0].pointer == "/options/owned/0/gripper_type"


@pytest.mark.parametrize(
    ("owned", "pointer"),
    [
        ([make_owned(), make_owned()], "/options/owned"),
        ([make_owned(opening_max=14.0)], "/options/owned/0"),
        ([make_owned(opening_min=-1.0)], "/options/owned/0/opening_min"),
        ([make_owned(finger_length=float("nan"))], "/options/owned/0/finger_length"),
        ([make_owned(color="red")], "/options/owned/0/color"),
        ([make_owned(grip="magnetic")], "/options/owned/0/grip"),
        ([make_owned(gripper_type=PARALLEL_2, v_angle=120.0)], "/options/owned/0"),
        ([make_owned(gripper_type=PARALLEL_2, v_angle=59.0, v_depth=3.0)], "/options/owned/0/v_angle"),
        ([make_owned(v_angle=120.0, v_depth=3.0)], "/options/owned/0"),
        (["old"], "/options/owned/0"),
    ],
)
def test_a_specification_that_is_none_is_refused_at_its_place(owned: list[Any], pointer: str) -> None:
    with pytest.raises(InvalidPlan) as refused:
        plan_of({"owned": owned})

    assert [fault.pointer for fault in refused.value.faults] == [pointer]


def test_an_actuator_that_bears_no_such_finger_gives_way_to_one_that_does() -> None:
    dainty, sturdy = make_actuator(model="dainty", finger_mass_max_kg=0.001), make_actuator(model="sturdy", mass_kg=0.5)

    result, _ = design([], actuators=[dainty, sturdy])

    assert result.document["status"] == "complete"
    assert {gripper["actuator"]["model"] for gripper in result.document["grippers"]} == {"sturdy"}
    reasons = {one["actuator"]: one for one in result.document["grippers"][0]["not_chosen"]}
    assert reasons["M/dainty"]["code"] == "finger-too-long"
    assert "at most 0.001" in reasons["M/dainty"]["detail"]


def test_an_operation_that_only_too_heavy_fingers_could_do_says_so() -> None:
    result, _ = design([], actuators=[make_actuator(finger_mass_max_kg=0.001)])

    assert result.document["status"] == "incomplete"
    assert all("at most 0.001" in operation["detail"] for operation in result.document["operations"])
