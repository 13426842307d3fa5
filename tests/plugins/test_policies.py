"""What a house forbids and prefers holds in a whole design, and its reason stands there."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gripwright.design import pipeline
from gripwright.design.plan import plan_of
from gripwright.design.stages.affordance import marked_shares
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import AssemblyTask, Component, GraspRegion, Operation
from gripwright.domain.errors import InvalidPlan, Rejection
from gripwright.domain.grasp import CENTRIC_3
from gripwright.domain.gripper import Actuator
from gripwright.domain.preference import INDIFFERENT, Preference
from gripwright.geometry import brep
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from gripwright.registry.plans import effective_plan
from gripwright.testing import sample_components
from gripwright.testing.primitives import centric_requirement
from gripwright_builtin.policies.surfaces import NeverGrip, NeverGripParams
from here_runner import HereRunner

LIGHT = Actuator(
    maker="Light", model="a", gripper_type=CENTRIC_3, stroke_mm=10.0, grip_force_N=200.0, opening_max_mm=40.0, mass_kg=0.4
)
HEAVY = replace(LIGHT, maker="Heavy", mass_kg=0.5, stroke_mm=12.0)
SHAFT = next(sample for sample in sample_components() if sample.name == "stepped shaft")


def design(*marks: GraspRegion, **options: Any) -> dict[str, Any]:
    """A peg of radius 15, set down alone, by one of two actuators."""
    down = np.stack([np.eye(4)] * 2)
    down[0, 2, 3] = 100.0
    peg = brep.tessellate(brep.cylinder_z(0.0, 0.0, 15.0, 0.0, 60.0), angle_rad=0.05)
    task = AssemblyTask(
        part_number="P",
        revision="A",
        name="",
        components=(Component(id="peg", mesh=peg, X_PC=np.eye(4), density_kg_m3=500.0, no_grasp=marks),),
        obstacles=(),
        operations=(Operation(id="op-1", active=("peg",), passive=(), motion=down),),
    )
    plan = plan_of(options)
    runner = HereRunner(plan, build_toolbox(plan, load_registry(allow=("gripwright",))))
    document: dict[str, Any] = runner.get(pipeline.design(task, [LIGHT, HEAVY], plan, runner)).document
    return document


def bought(document: dict[str, Any]) -> list[str]:
    return [gripper["actuator"]["maker"] for gripper in document["grippers"]]


def not_chosen(document: dict[str, Any]) -> dict[str, tuple[str, str]]:
    (gripper,) = document["grippers"]
    return {one["actuator"]: (one["code"], one["detail"]) for one in gripper["not_chosen"]}


def test_only_the_makers_that_are_allowed_are_bought_and_the_others_say_by_which_policy() -> None:
    document = design(policies=["only_makers"], only_makers={"makers": ["heavy"]})

    assert bought(document) == ["Heavy"]
    assert not_chosen(document)["Light/a"] == (
        "maker-not-allowed",
        "policy only_makers: the maker is Light, only heavy may be bought",
    )


def test_where_no_maker_is_left_the_operation_says_what_the_house_refuses() -> None:
    document = design(policies=["only_makers"], only_makers={"makers": ["Other"]}, finest_rotation=15, finest_step=5)

    assert document["grippers"] == []
    assert document["operations"][0]["detail"].endswith(
        "; the house refuses 2 of the type: Light/a, policy only_makers: the maker is Light, only Other may be bought"
    )


def test_a_preferred_maker_is_taken_where_its_factor_outweighs_the_mass_and_the_gripper_says_so() -> None:
    by_mass, by_house = design(), design(policies=["prefer_makers"], prefer_makers={"makers": ["HEAVY"], "factor": 0.7})
    hardly = design(policies=["prefer_makers"], prefer_makers={"makers": ["HEAVY"], "factor": 0.9})

    assert [bought(document) for document in (by_mass, by_house, hardly)] == [["Light"], ["Heavy"], ["Light"]]
    assert by_mass["grippers"][0]["remarks"] == []
    assert by_house["grippers"][0]["remarks"] == ["Heavy/a: policy prefer_makers, factor 0.7: Heavy is preferred"]
    code, detail = not_chosen(by_house)["Light/a"]
    assert code == "heavier"
    assert detail.endswith("; Heavy/a by policy prefer_makers, factor 0.7: Heavy is preferred")


def test_a_segment_that_carries_a_mark_is_not_gripped_at_all_where_the_house_says_so() -> None:
    ground = GraspRegion(
        reason="ground surface", box_min_C=np.array([-20.0, -20.0, -1.0]), box_max_C=np.array([20.0, 20.0, 20.0])
    )

    gripped = design(ground)
    refused = design(ground, policies=["never_grip"], never_grip={"marks": ["Ground"]})

    assert gripped["status"] == "complete"
    assert refused["status"] == "incomplete"
    rejections = {(item["rejection"], item["detail"].partition(": ")[0]) for item in refused["components"][0]["segments"]}
    assert ("marked-surface", "policy never_grip") in rejections


def test_the_papers_plan_takes_no_policy() -> None:
    with pytest.raises(InvalidPlan) as refused:
        effective_plan(plan_of({"plan": "paper", "policies": ["only_makers"]}))

    assert [fault.pointer for fault in refused.value.faults] == ["/options/policies"]


@pytest.mark.parametrize(
    ("params", "marks", "code"),
    [
        ({}, {"ground": 1.0}, None),
        ({"marks": ("GROUND",)}, {"ground by hand": 0.01}, "marked-surface"),
        ({"marks": ("ground",), "share_min": 0.5}, {"ground": 0.49}, None),
        ({"marks": ("ground",)}, {"thread": 1.0}, None),
        ({"primitives": ("cylinder",)}, {}, "primitive-not-allowed"),
        ({"primitives": ("box",)}, {}, None),
        ({"area_min": SHAFT.segments[0].area_mm2 + 0.1}, {}, "too-small"),
        ({"area_min": SHAFT.segments[0].area_mm2}, {}, None),
    ],
)
def test_a_grip_is_forbidden_for_its_mark_its_primitive_or_its_size(params, marks, code) -> None:
    answer = NeverGrip(NeverGripParams(**params)).grip(SHAFT.component, SHAFT.segments[0], centric_requirement(np.eye(4)), marks)

    assert (answer.code if isinstance(answer, Rejection) else None) == code


def test_little_of_a_mark_is_avoided_by_how_much_there_is() -> None:
    policy = NeverGrip(NeverGripParams(marks=("ground",), share_min=0.5))

    answers = [
        policy.grip(SHAFT.component, SHAFT.segments[0], centric_requirement(np.eye(4)), {"ground": share}) for share in (0.1, 0.2)
    ]

    assert [answer.factor for answer in answers if isinstance(answer, Preference)] == [1.1, 1.2]


def test_regions_of_one_reason_count_once_where_they_overlap() -> None:
    mesh, segment = SHAFT.component.mesh, SHAFT.segments[0]
    everywhere = Forbidden(reason="ground", detector="marked", faces=np.ones(len(mesh.faces), dtype=bool))
    nowhere = replace(everywhere, reason="thread", faces=np.zeros(len(mesh.faces), dtype=bool))

    assert marked_shares(mesh, segment, [everywhere, everywhere, nowhere]) == {"ground": pytest.approx(1.0)}


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), float("inf")])
def test_a_factor_that_is_no_number_above_zero_is_refused(factor: float) -> None:
    with pytest.raises(ValueError, match="a finite number above 0 is needed"):
        Preference(factor=factor, detail="no")


def test_no_opinion_weighs_nothing() -> None:
    assert INDIFFERENT.factor == 1.0
