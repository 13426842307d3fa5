"""Whether the design speaks of every operation and component, once, and its files are there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from checker.fault import Fault
from checker.package import Package


def check_coverage(folder: Path, design: dict[str, Any], package: Package) -> Iterator[Fault]:
    for name in ("bom.csv", "report.html"):
        if not (folder / name).is_file():
            yield Fault("", "", "files", f"{name} is missing")
    for operation, detail in _operations(design, package):
        yield Fault("", operation, "coverage", detail)
    for detail in _components(design, package):
        yield Fault("", "", "coverage", detail)
    for gripper in design["grippers"]:
        for handle in gripper["handles"]:
            for detail in _grasped(gripper, handle, design, package):
                yield Fault(gripper["id"], handle["operation"], "coverage", detail)


def _operations(design: dict[str, Any], package: Package) -> Iterator[tuple[str, str]]:
    stated = {operation["id"]: operation for operation in design["operations"]}
    handles = Counter(handle["operation"] for gripper in design["grippers"] for handle in gripper["handles"])
    for name in package.operations.keys() ^ stated.keys():
        yield name, "is not both in the package and in the design"
    for name, operation in stated.items():
        covered = operation["status"] == "covered"
        if handles[name] != int(covered):
            yield name, f"is {operation['status']} and has {handles[name]} handles"
        if not covered and not operation["detail"]:
            yield name, "is uncovered without a reason"
    complete = all(operation["status"] == "covered" for operation in stated.values())
    if (design["status"] == "complete") != complete:
        yield "", f"the design is {design['status']}, its operations say otherwise"


def _components(design: dict[str, Any], package: Package) -> Iterator[str]:
    stated = {component["id"]: component["status"] for component in design["components"]}
    moved = {name for operation in package.operations.values() for name in operation.active}
    for name in package.components.keys() ^ stated.keys():
        yield f"component {name} is not both in the package and in the design"
    for name, status in stated.items():
        if (status == "not_moved") != (name not in moved):
            yield f"component {name} is {status}, the operations say otherwise"


def _grasped(gripper: dict[str, Any], handle: dict[str, Any], design: dict[str, Any], package: Package) -> Iterator[str]:
    """The handle's component is one that the operation grasps, by a graspable segment that admits the finger length."""
    operation = package.operations.get(handle["operation"])
    if operation is None or handle["component"] not in operation.grasp:
        yield f"{handle['component']} is not what the operation grasps"
        return
    segments = next(entry["segments"] for entry in design["components"] if entry["id"] == handle["component"])
    segment = next((entry for entry in segments if entry["id"] == handle["segment"]), None)
    if segment is None or not segment["graspable"]:
        yield f"segment {handle['segment']} is not graspable"
        return
    low, high = segment["finger_length_min"], segment["finger_length_max"]
    if gripper["finger_length"] < (low or 0.0) - 1e-3 or (high is not None and gripper["finger_length"] > high + 1e-3):
        yield f"finger length {gripper['finger_length']} mm outside the segment's {low} to {high} mm"
