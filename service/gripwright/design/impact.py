"""What a change of revision does to a gripper set: two design documents compared, the second made with the first's grippers."""

from collections.abc import Mapping
from typing import Any

from gripwright.design.owned import specifications

Document = Mapping[str, Any]

HELD, OTHER_GRIPPER, NOT_HELD, ADDED, REMOVED = "held", "other_gripper", "not_held", "added", "removed"
UNCHANGED, CHANGED = "unchanged", "changed"

_LOST = (OTHER_GRIPPER, NOT_HELD)
_OF_SEGMENT = ("area", "primitive", "gripper_type", "grip", "opening_width", "graspable", "rejection")


def change_impact(before: Document, after: Document) -> dict[str, Any]:
    """What holds still and what does not, as JSON. `after` is a design of the new revision that owns all grippers of `before`."""
    names = {gripper["id"]: given["name"] for gripper, given in zip(before["grippers"], specifications(before), strict=True)}
    operations = _operations(before, after, names)
    return {
        "operations": operations,
        "grippers": [
            {
                "id": gripper_id,
                "name": name,
                "holds": [op["id"] for op in operations if op["before"] == name and op["outcome"] == HELD],
                "no_longer_holds": [
                    op["id"] for op in operations if op["before"] == name and op["outcome"] in (OTHER_GRIPPER, NOT_HELD)
                ],
            }
            for gripper_id, name in names.items()
        ],
        "new_grippers": [gripper["id"] for gripper in after["grippers"] if gripper["owned"] is None],
        "components": _components(before, after),
    }


def _operations(before: Document, after: Document, names: Mapping[str, str]) -> list[dict[str, Any]]:
    """Operations in the new order, then those that are gone. A gripper of `before` goes by its name, a new one by its id."""
    known = {operation["id"]: operation for operation in before["operations"]}
    names_after = {gripper["id"]: gripper["owned"] or gripper["id"] for gripper in after["grippers"]}
    compared = []
    for operation in after["operations"]:
        earlier = known.pop(operation["id"], None)
        former = names[earlier["gripper"]] if earlier is not None else None
        if operation["status"] != "covered":
            outcome = NOT_HELD
        elif earlier is None:
            outcome = ADDED
        else:
            outcome = HELD if former in operation["owned_that_hold"] else OTHER_GRIPPER
        now = former if outcome == HELD else names_after.get(operation["gripper"])
        compared.append(
            {"id": operation["id"], "outcome": outcome, "before": former, "after": now, "detail": operation["detail"]}
        )
    gone = [
        {"id": op_id, "outcome": REMOVED, "before": names[earlier["gripper"]], "after": None, "detail": None}
        for op_id, earlier in known.items()
    ]
    return compared + gone


def _components(before: Document, after: Document) -> list[dict[str, Any]]:
    """Whether the segments of each component, and what may be gripped of them, are what they were."""
    known = {component["id"]: component for component in before["components"]}
    compared = []
    for component in after["components"]:
        earlier = known.pop(component["id"], None)
        if earlier is None:
            compared.append({"id": component["id"], "outcome": ADDED, "segments": []})
            continue
        lost = _lost_segments(earlier, component)
        same = not lost and len(earlier["segments"]) == len(component["segments"])
        compared.append({"id": component["id"], "outcome": UNCHANGED if same else CHANGED, "segments": lost})
    return compared + [{"id": component_id, "outcome": REMOVED, "segments": []} for component_id in known]


def _lost_segments(earlier: Document, component: Document) -> list[int]:
    """Ids of the segments of the earlier revision that have no equal in the new one."""
    left = [[segment[key] for key in _OF_SEGMENT] for segment in component["segments"]]
    lost = []
    for segment in earlier["segments"]:
        figures = [segment[key] for key in _OF_SEGMENT]
        if figures in left:
            left.remove(figures)
        else:
            lost.append(segment["id"])
    return lost
