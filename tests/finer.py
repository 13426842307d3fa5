"""A design asked again with finer steps: what its calculation withdraws of what it promised."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from gripwright.cad.limits import DEFAULT_LIMITS
from gripwright.cad.package import read_package
from gripwright.cli.options import options_of
from gripwright.design import motion, sweeps
from gripwright.design.finger_lengths import palm_hit
from gripwright.design.grasp_judge import GraspJudge
from gripwright.design.hand_check import HandCheck
from gripwright.design.plan import plan_of
from gripwright.design.scenes import held_component
from gripwright.design.stage_table import STAGES
from gripwright.design.stages.constraints import SegmentSearch
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import Grasp, SegmentVerdict
from gripwright.plugin_api import RunContext
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from gripwright.registry.plans import effective_plan
from package_scenes import bodies_of, operation_of, scene_of

FINER = 10
PALM_RADIUS_MM = 63.0
FINER_GRASPS = (  # every step a tenth; rotations and offsets hold those of the default plan, depths along a cylinder do not
    "axial.rotation_step=1.5",
    "axial.depths=50",
    "facet_pairs.rotation_step=1.5",
    "facet_pairs.offset_step=0.5",
    "facet_pairs.offsets_max=61",
    "facet_pairs.depths=21",
)
Segment = tuple[str, int]


@contextmanager
def finer_motions() -> Iterator[None]:
    """Arcs are divided ten times as finely; straight legs are swept one by one, as given."""
    arcs = {name: getattr(sweeps, name) / FINER for name in ("_COARSE_ARC_RAD", "_FINE_ARC_RAD")}
    legs = mock.patch.multiple(motion, _ARC_RAD=motion._ARC_RAD / FINER, _goes_on=lambda before, move: False)
    with legs, mock.patch.multiple(sweeps, **arcs):
        yield


def withdrawn_handles(folder: Path, package: Path) -> list[str]:
    """What is found against handles of a design folder when each leg of a motion is judged as ten; every handle is asked."""
    document = json.loads((folder / "design.json").read_text())
    task = read_package(package, DEFAULT_LIMITS)
    plan = plan_of({key: document["plan"]["options"][key] for key in ("plan", "margin", "release_clearance")})
    hands = build_toolbox(effective_plan(plan), load_registry()).hands
    bodies = bodies_of(task)
    found = []
    for gripper in document["grippers"]:
        for handle in gripper["handles"]:
            operation = operation_of(task, handle["component"])
            way = np.array(motion.sampled(operation.motion, FINER * (len(operation.motion) - 1)))
            scene = scene_of(task, replace(operation, motion=way), bodies, handle["component"], plan)
            with finer_motions():
                said = _against(HandCheck(scene, hands[gripper["gripper_type"]]), gripper, handle)
            found += [f"{gripper['id']} {handle['operation']}: {one}" for one in said]
    return found


def free_segments(document: dict[str, Any]) -> set[Segment]:
    """(component, segment) of each segment with a free grasp."""
    return {
        (component["id"], segment["id"])
        for component in document["components"]
        for segment in component["segments"]
        if segment["graspable"]
    }


def _against(check: HandCheck, gripper: dict[str, Any], handle: dict[str, Any]) -> list[str]:
    grasp = Grasp(
        X_CG=np.array(handle["grasp_pose"]),
        gripper_type=gripper["gripper_type"],
        grip=gripper["grip"],
        opening_width_mm=handle["opening_width"],
    )
    stems = check.seated(grasp, gripper["finger_length"])
    palm = palm_hit(check, grasp, gripper["palm_radius"], gripper["finger_length"])
    return ([] if stems is None else [stems.detail]) + ([] if palm is None else [f"the palm hits {palm}"])


def judged(package: Path, component: str, settings: tuple[str, ...]) -> list[SegmentVerdict]:
    """How the segments of a component fare in its operation, with `--set` options and a palm of `PALM_RADIUS_MM`."""
    plan = effective_plan(plan_of(options_of(list(settings))))
    toolbox = build_toolbox(plan, load_registry())
    task = read_package(package, DEFAULT_LIMITS)
    held, operation = task.component(component), operation_of(task, component)
    inputs: dict[str, Any] = {"component": held, "mesh": held.mesh, "segmenter": "sdf"}
    for stage, name in (("prepare", "prepared"), ("segment", "segmentation"), ("fit", "analysis"), ("grips", "grips")):
        inputs[name] = STAGES[stage].function(inputs, plan, toolbox, RunContext())
    bodies = bodies_of(task)
    scene = scene_of(task, operation, bodies, component, plan)
    carried = held_component(operation, bodies[component], [], inputs["prepared"].mesh, inputs["grips"].forbidden)
    asked = [(item, inputs["grips"].segments[item.segment.id]) for item in inputs["analysis"].segments]
    judge = GraspJudge(carried, scene, lambda gripper_type, width: np.array([PALM_RADIUS_MM]), RunContext())
    searches = [
        SegmentSearch(item, needs, judge, toolbox, RunContext()) for item, needs in asked if not isinstance(needs, Rejection)
    ]
    for search in searches:
        search.planned()
    return [search.verdict("") for search in searches]
