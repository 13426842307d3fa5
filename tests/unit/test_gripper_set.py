"""The gripper-set problem as JSON."""

import copy
import json
import math
from typing import Any

import pytest

from gripwright.design.gripper_set import fingers_of, minimise
from gripwright.domain.errors import InvalidInput
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer, SetCoverParams

OPTIMIZER = SetCoverOptimizer(SetCoverParams())


def make_document(**changes: Any) -> dict[str, Any]:
    alternative = {"gripper_type": "centric-3", "opening_width": 20.0, "finger_length_min": 10, "finger_length_max": None}
    document = {
        "strokes": {"parallel-2": 48, "centric-3": 8},
        "release_clearance": 1,
        "components": [
            {"id": "rotor", "alternatives": [alternative]},
            {"id": "key", "alternatives": [{**alternative, "gripper_type": "parallel-2", "finger_length_max": 40}]},
            {"id": "frame", "alternatives": []},
        ],
    }
    return {**copy.deepcopy(document), **changes}


def fault_of(document: object) -> list[str]:
    with pytest.raises(InvalidInput) as caught:
        minimise(document, OPTIMIZER)
    return [fault.pointer for fault in caught.value.faults]


def test_the_answer_names_fingers_range_length_and_components_of_each_gripper() -> None:
    answer = minimise(make_document(), OPTIMIZER)

    assert answer["grippers"] == [
        {
            "gripper_type": "centric-3",
            "fingers": 3,
            "opening_min": 13.0,
            "opening_max": 21.0,
            "finger_length": 10.0,
            "components": ["rotor"],
            "owned": False,
        },
        {
            "gripper_type": "parallel-2",
            "fingers": 2,
            "opening_min": 0.0,
            "opening_max": 21.0,
            "finger_length": 10.0,
            "components": ["key"],
            "owned": False,
        },
    ]
    assert (answer["lower_bound"], answer["proven"], answer["uncoverable"], answer["new"]) == (2, True, ["frame"], 2)
    json.dumps(answer, allow_nan=False)


def test_an_owned_gripper_is_no_new_one() -> None:
    owned = {"gripper_type": "centric-3", "opening_min": 15, "opening_max": 23, "finger_length": 30}

    answer = minimise(make_document(owned=[owned]), OPTIMIZER)

    assert (answer["new"], answer["lower_bound"]) == (1, 1)
    assert [gripper["owned"] for gripper in answer["grippers"]] == [True, False]


@pytest.mark.parametrize("document", [None, [], "x", 3, {}, {"strokes": {}}])
def test_what_is_no_document_is_refused(document: object) -> None:
    assert fault_of(document)


@pytest.mark.parametrize(
    ("path", "value", "pointer"),
    [
        (("strokes", "centric-3"), -1, "/strokes/centric-3"),
        (("strokes", "centric-3"), math.nan, "/strokes/centric-3"),
        (("strokes", "centric"), 8, "/strokes/centric"),
        (("strokes", "a/b~c"), 8, "/strokes/a~1b~0c"),
        (("release_clearance",), -0.1, "/release_clearance"),
        (("components", 0, "id"), "key", "/components/1/id"),
        (("components", 0, "alternatives", 0, "gripper_type"), "vacuum-1", "/components/0/alternatives/0/gripper_type"),
        (("components", 0, "alternatives", 0, "opening_width"), "20", "/components/0/alternatives/0/opening_width"),
        (("components", 0, "alternatives", 0, "opening_width"), math.inf, "/components/0/alternatives/0/opening_width"),
        (("components", 0, "alternatives", 0, "opening_width"), True, "/components/0/alternatives/0/opening_width"),
        (("components", 0, "alternatives", 0, "finger_length_max"), 9, "/components/0/alternatives/0/finger_length_max"),
        (("components", 0, "alternatives", 0, "finger_lenght_max"), 9, "/components/0/alternatives/0/finger_lenght_max"),
    ],
)
def test_each_fault_is_named_by_its_pointer(path: tuple[Any, ...], value: object, pointer: str) -> None:
    document = make_document()
    place: Any = document
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value

    assert fault_of(document) == [pointer]


def test_all_faults_are_named_together() -> None:
    document = make_document(release_clearance=-1, strokes={"parallel-2": 0})

    assert fault_of(document) == ["/strokes/parallel-2", "/release_clearance"]


@pytest.mark.parametrize(
    ("gripper_type", "fingers"), [("parallel-2", 2), ("centric-3", 3), ("soft-12", 12), ("vacuum", None), ("x-0", None)]
)
def test_a_type_ends_with_its_number_of_fingers(gripper_type: str, fingers: int | None) -> None:
    assert fingers_of(gripper_type) == fingers
