"""From verdicts to grippers."""

import dataclasses
import json
import os
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gripwright.design.catalogue import envelope_ladder
from gripwright.design.catalogue import select as select_actuators
from gripwright.design.demand import SelectOptions
from gripwright.design.stages.select import Selection, select
from gripwright.domain.assembly import AssemblyTask, Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, PARALLEL_2, FreeGrasp, Grasp, Hold, OperationVerdict, SegmentVerdict
from gripwright.domain.gripper import Actuator
from gripwright.plugin_api import RunContext
from gripwright.store.seed import seed_actuators
from gripwright_builtin.hands.centric import CentricHand, CentricSettings
from gripwright_builtin.hands.parallel import ParallelHand
from gripwright_builtin.hands.prism import HandSettings
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer, SetCoverParams

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"
LADDER = envelope_ladder(400.0)


def make_free(width_mm: float, **figures: Any) -> FreeGrasp:
    figures = {
        "gripper_type": CENTRIC_3,
        "length_min": 20.0,
        "length_max": np.inf,
        "release": 1.0,
        "force": 10.0,
        "gap": 1.0,
        **figures,
    }
    grasp = Grasp(X_CG=np.eye(4), gripper_type=figures["gripper_type"], grip=EXTERNAL, opening_width_mm=width_mm)
    return FreeGrasp(
        grasp=grasp,
        envelopes_mm=LADDER,
        finger_length_min_mm=np.full(len(LADDER), figures["length_min"]),
        finger_length_max_mm=figures["length_max"],
        release_opening_mm=width_mm + figures["release"],
        gap_mm=figures["gap"],
        hold=Hold(required_force_N=figures["force"], moment_Nmm=0.0, symmetry=1.0),
    )


def make_verdict(operation: str, *free: FreeGrasp, rejection: Rejection | None = None) -> OperationVerdict:
    segments = [
        SegmentVerdict(segment=i, requirement=None, grasps_planned=1, free=(one,), rejection=None) for i, one in enumerate(free)
    ]
    if rejection is not None:
        segments.append(SegmentVerdict(segment=len(free), requirement=None, grasps_planned=4, free=(), rejection=rejection))
    return OperationVerdict(operation=operation, components={f"c-{operation}": tuple(segments)}, warnings=(), timings={})


def make_task(operations: Sequence[str]) -> AssemblyTask:
    made = tuple(Operation(id=op, active=(f"c-{op}",), passive=(), motion=np.stack([np.eye(4)] * 2)) for op in operations)
    return AssemblyTask(part_number="P", revision="A", name="", components=(), obstacles=(), operations=made)


def make_actuator(model: str, **figures: Any) -> Actuator:
    figures = {
        "gripper_type": CENTRIC_3,
        "stroke_mm": 20.0,
        "opening_max_mm": 40.0,
        "mass_kg": 0.5,
        "grip_force_N": 100.0,
        **figures,
    }
    return Actuator(maker="M", model=model, **figures)


def run(verdicts: Sequence[OperationVerdict], actuators: Sequence[Actuator], **options: Any) -> Selection:
    hands = {CENTRIC_3: CentricHand(CentricSettings()), PARALLEL_2: ParallelHand(HandSettings())}
    toolbox: Any = SimpleNamespace(optimizer=SetCoverOptimizer(SetCoverParams()), hands=hands, holding={})
    task = make_task([verdict.operation for verdict in verdicts])
    return select(task, verdicts, actuators, SelectOptions(**options), toolbox, RunContext())


@pytest.fixture
def paper_verdicts() -> list[OperationVerdict]:
    path = SHARED / "paper-widths.json"
    if not path.exists() and os.environ.get("CI") != "true":
        pytest.skip(f"{path} is not there")
    components = json.loads(path.read_text(encoding="utf-8"))["components"]
    return [
        make_verdict(
            component["id"],
            *(
                make_free(a["opening_width"], gripper_type=a["gripper_type"], length_min=a["finger_length_min"], release=0.0)
                for a in component["alternatives"]
            ),
        )
        for component in components
    ]


def summary(selection: Selection) -> list[tuple[str, float, float, float]]:
    return [(g.actuator.model, g.opening_min_mm, g.opening_max_mm, g.finger_length_mm) for g in selection.grippers]


def test_the_papers_plan_gives_the_papers_grippers(paper_verdicts: list[OperationVerdict]) -> None:
    air_chucks = select_actuators(seed_actuators(), "paper")

    selection = run(paper_verdicts, air_chucks, release_clearance_mm=0.0, enforce_hold=False, weigh_sequence=False)

    centric, parallel = "MHSL3-32D (as in paper)", "MHF2-12D2"
    assert summary(selection) == [
        (centric, 14.0, 22.0, 30.0),
        (centric, 52.5, 60.5, 30.0),
        (centric, 116.9, 124.9, 30.0),
        (parallel, 0.0, 33.0, 30.0),
    ]
    assert [gripper.id for gripper in selection.grippers] == ["G1", "G2", "G3", "G4"]
    assert selection.optimum["proven"]


def test_every_operation_is_handled_once_with_a_grasp_that_its_gripper_holds(paper_verdicts: list[OperationVerdict]) -> None:
    selection = run(paper_verdicts, select_actuators(seed_actuators(), "paper"), release_clearance_mm=0.0, enforce_hold=False)

    handled = [handle.operation for gripper in selection.grippers for handle in gripper.handles]
    assert sorted(handled) == sorted(verdict.operation for verdict in paper_verdicts)
    for gripper in selection.grippers:
        assert gripper.opening_max_mm - gripper.opening_min_mm <= gripper.actuator.stroke_mm + 1e-9
        for handle in gripper.handles:
            assert gripper.opening_min_mm - 1e-9 <= handle.opening_width_mm <= handle.release_opening_mm
            assert handle.release_opening_mm <= gripper.opening_max_mm + 1e-9


def test_the_same_verdicts_give_the_same_selection(paper_verdicts: list[OperationVerdict]) -> None:
    actuators = select_actuators(seed_actuators(), "paper")

    first, second = (run(paper_verdicts, order) for order in (actuators, tuple(reversed(actuators))))

    assert summary(first) == summary(second)
    assert first.optimum == second.optimum


def test_an_actuator_too_weak_is_vetoed() -> None:
    weak, strong = make_actuator("weak", grip_force_N=19.9, mass_kg=0.1), make_actuator("strong", grip_force_N=20.0)

    selection = run([make_verdict("op", make_free(30.0, force=10.0))], [weak, strong], safety_factor=2.0)

    (gripper,) = selection.grippers
    assert gripper.actuator == strong
    assert gripper.handles[0].safety_factor == 2.0


def test_an_unknown_force_is_reported_and_not_enforced() -> None:
    unknown = make_actuator("unknown", grip_force_N=None)

    (gripper,) = run([make_verdict("op", make_free(30.0, force=1e6))], [unknown]).grippers

    assert gripper.handles[0].safety_factor is None


def test_a_known_force_is_preferred_to_an_unknown_one() -> None:
    unknown, known = make_actuator("unknown", grip_force_N=None, mass_kg=0.1), make_actuator("known", mass_kg=2.0)

    assert run([make_verdict("op", make_free(30.0))], [unknown, known]).grippers[0].actuator == known


def test_the_lightest_actuator_that_serves_is_chosen() -> None:
    heavy, light = make_actuator("heavy", mass_kg=0.5), make_actuator("light", mass_kg=0.4, stroke_mm=5.0)

    assert run([make_verdict("op", make_free(30.0))], [heavy, light]).grippers[0].actuator == light


def test_prices_decide_where_all_are_known() -> None:
    heavy, light = (
        make_actuator("heavy", mass_kg=0.5, price=100.0),
        make_actuator("light", mass_kg=0.4, stroke_mm=5.0, price=200.0),
    )

    assert run([make_verdict("op", make_free(30.0))], [heavy, light]).grippers[0].actuator == heavy


def test_the_finger_length_is_the_one_behind_the_actuators_own_envelope() -> None:
    free = make_free(30.0)
    free = dataclasses.replace(free, finger_length_min_mm=LADDER)  # as long as the palm is wide

    (gripper,) = run(
        [make_verdict("op", free)], [make_actuator("a", opening_max_mm=80.0, mass_kg=0.1)], finger_length_step_mm=0.0
    ).grippers

    assert gripper.envelope_mm == gripper.finger_length_mm == 50.0  # 80 / 2 and a jaw of 10 mm


def test_a_wider_release_than_the_clearance_is_kept() -> None:
    (gripper,) = run([make_verdict("op", make_free(30.0, release=6.0))], [make_actuator("a")]).grippers

    assert gripper.opening_max_mm == 36.0
    assert gripper.jaw_offset_mm == -2.0


def test_the_safest_grasp_is_taken_then_the_one_with_the_largest_gap() -> None:
    grasps = [make_free(30.0, force=12.0, gap=9.0), make_free(30.0, force=10.0, gap=1.0), make_free(30.0, force=10.0, gap=2.0)]

    (gripper,) = run([make_verdict("op", *grasps)], [make_actuator("a")]).grippers

    assert gripper.handles[0].segment == 2


def test_a_gripper_is_kept_for_the_next_operation_as_long_as_it_serves() -> None:
    wide, both, narrow = make_free(100.0), (make_free(100.0), make_free(10.0)), make_free(10.0)
    verdicts = [make_verdict("1", narrow), make_verdict("2", *both), make_verdict("3", wide), make_verdict("4", *both)]

    selection = run(verdicts, [make_actuator("a")])

    assert [[handle.operation for handle in gripper.handles] for gripper in selection.grippers] == [["1", "2"], ["3", "4"]]
    assert selection.optimum["tool_changes"] == 1


def test_an_operation_without_grasp_names_the_constraint_that_came_closest() -> None:
    verdict = make_verdict("op", rejection=Rejection("collision", "finger 2 enters the cover by 1.20 mm, at least 0.10 mm away"))

    selection = run([verdict], [make_actuator("a")])

    assert selection.grippers == ()
    assert "segment 0 of c-op (collision): finger 2 enters the cover by 1.20 mm" in selection.not_covered["op"]


@pytest.mark.parametrize(
    ("free", "words"),
    [
        (make_free(30.0, force=60.0), ["not-held", "120.0 N", "100.0 N"]),
        (make_free(300.0), ["too-wide", "301.00 mm", "240.00 mm"]),
        (make_free(30.0, length_min=81.0), ["finger-too-long", "81.00 mm", "80.00 mm"]),
        (make_free(30.0, release=21.0), ["stroke-too-short", "21.00 mm", "20.00 mm"]),
        (make_free(30.0, gripper_type=PARALLEL_2), ["parallel-2"]),
    ],
)
def test_an_operation_without_actuator_names_the_measured_value_and_the_limit(free: FreeGrasp, words: list[str]) -> None:
    selection = run([make_verdict("op", free)], [make_actuator("a", finger_length_max_mm=80.0)])

    told = selection.not_covered["op"]
    assert told.startswith("c-op cannot be held in op: ")
    assert all(word in told for word in words), told


def test_each_gripper_says_of_every_other_actuator_why_it_is_not_chosen() -> None:
    actuators = select_actuators(seed_actuators(), "all")

    selection = run([make_verdict("1", make_free(30.0)), make_verdict("2", make_free(400.0), make_free(30.0))], actuators)

    assert selection.grippers
    for gripper in selection.grippers:
        reasons = selection.not_chosen[gripper.id]
        assert set(reasons) == {actuator.name for actuator in actuators} - {gripper.actuator.name}
        assert reasons["Robotiq/2F-85"].code == "other-type"


@pytest.mark.parametrize(
    ("figures", "code", "words"),
    [
        ({"mass_kg": 0.6, "opening_max_mm": 30.0}, "heavier", "0.6 kg, M/chosen 0.5 kg"),
        ({"opening_max_mm": 30.0, "mass_kg": None, "body_diameter_mm": 70.0}, "heavier", "(estimated)"),
        ({"grip_force_N": None, "mass_kg": 0.1}, "unknown-force", "is not known"),
        ({"grip_force_N": 19.0, "mass_kg": 0.1}, "not-held", "cannot serve 1: friction needs 20.0 N"),
        ({"finger_length_max_mm": 19.0, "mass_kg": 0.1}, "finger-too-long", "19.00 mm are allowed"),
        ({"stroke_mm": 2.0, "mass_kg": 0.1}, "range-too-short", "stroke 2 mm"),
        ({"mass_kg": 0.7, "stroke_mm": 19.0}, "outdone", "stroke 20 mm against 19 mm"),
        ({"gripper_type": PARALLEL_2}, "other-type", "is parallel-2"),
    ],
)
def test_the_reason_against_an_actuator_is_the_one_that_decides(figures: dict[str, Any], code: str, words: str) -> None:
    verdicts = [make_verdict("1", make_free(30.0)), make_verdict("2", make_free(35.0))]

    selection = run(verdicts, [make_actuator("chosen"), make_actuator("other", **figures)])

    (gripper,) = selection.grippers
    reason = selection.not_chosen["G1"]["M/other"]
    assert (gripper.actuator.model, reason.code) == ("chosen", code), reason
    assert words in reason.detail


def test_an_actuator_that_bears_lighter_fingers_alone_outdoes_none() -> None:
    actuators = [make_actuator("dainty", mass_kg=0.4, finger_mass_max_kg=0.1), make_actuator("sturdy", opening_max_mm=40.0)]

    selection = run([make_verdict("1", make_free(30.0))], actuators)

    assert [gripper.actuator.model for gripper in selection.grippers] == ["dainty"]
    assert selection.optimum["cost"] == {"basis": "mass", "sum": 0.4, "unknown_forces": 0}
    assert selection.not_chosen["G1"]["M/sturdy"].code == "heavier"


def test_prices_are_the_reason_where_all_are_known() -> None:
    actuators = [make_actuator("chosen", price=10.0, opening_max_mm=30.0), make_actuator("other", price=20.0, stroke_mm=30.0)]

    selection = run([make_verdict("1", make_free(30.0))], actuators)

    assert selection.not_chosen["G1"]["M/other"] == Rejection("dearer", "price 20, that of M/chosen 10")
    assert selection.optimum["cost"] == {"basis": "price", "sum": 10.0, "unknown_forces": 0}


def test_a_gripper_that_is_owned_is_used_before_a_new_one() -> None:
    verdicts = [make_verdict("1", make_free(30.0)), make_verdict("2", make_free(90.0))]
    owned = run(verdicts[:1], [make_actuator("a")]).grippers

    selection = run(verdicts, [make_actuator("b")], owned=owned)

    assert selection.optimum["new"] == 1
    assert [gripper.actuator.model for gripper in selection.grippers] == ["a", "b"]
    assert selection.owned == {"G1": "G1"}


def test_no_operations_need_no_gripper() -> None:
    assert run([], [make_actuator("a")]).grippers == ()
