"""Checks of grasp planners: rigid poses that keep the requirement."""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL, PARALLEL_2, SURFACE, Grasp, GripRequirement
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import is_rigid, moved
from gripwright.plugin_api import grips_of
from gripwright.testing.primitives import centric_requirement, face_requirement, parallel_requirement, v_requirement
from gripwright.testing.sample_hands import SampleFace, SampleHand
from gripwright.testing.samples import TILTED, sample_components
from gripwright.testing.trial import Case, Check, Trial, is_length

_ALONG = np.cos(np.radians(1.0))


def cases(trial: Trial) -> list[Case]:
    """A shaft for centric grippers and V tips, a box for parallel ones, both for a type that is unknown; a box for a face."""
    samples = {sample.name: sample for sample in sample_components()}
    found = []
    for gripper_type in sorted(trial.plugin.gripper_types):
        for prefix, X_CB in (("", np.eye(4)), ("tilted ", TILTED)):
            for name, requirement in _asked(trial.plugin, gripper_type, X_CB):
                sample, hand = samples[prefix + name], _hand(requirement)
                arguments = {"component": sample.component, "segment": sample.segments[0], "requirement": requirement}
                title = f"{prefix}{name}, {gripper_type}{' by a face' if requirement.grip == SURFACE else ''}"
                found.append(Case(name=title, method="plan", arguments={**arguments, "hand": hand}))
    return found


def _asked(plugin: Any, gripper_type: str, X_CB: FloatArray) -> Iterable[tuple[str, GripRequirement]]:
    """(sample, requirement) of the grips that the planner serves."""
    grips = grips_of(plugin)
    if EXTERNAL in grips and gripper_type != PARALLEL_2:
        yield "stepped shaft", centric_requirement(X_CB, gripper_type)
    if EXTERNAL in grips and gripper_type not in (CENTRIC_3, CENTRIC_4):
        yield "box with boss", parallel_requirement(X_CB, gripper_type)
    if EXTERNAL in grips and gripper_type == PARALLEL_2:
        yield "stepped shaft", v_requirement(X_CB)
    if SURFACE in grips:
        yield "box with boss", face_requirement(X_CB, gripper_type)


def _hand(requirement: GripRequirement) -> SampleHand:
    if requirement.grip == SURFACE:
        return SampleFace(requirement.gripper_type, requirement.opening_width_mm)
    return SampleHand(requirement.gripper_type, {PARALLEL_2: 2, CENTRIC_4: 4}.get(requirement.gripper_type, 3))


def grasps(trial: Trial) -> Iterable[str]:
    """Grasps are rigid and of the gripper that was asked for."""
    for case, found in trial.answers():
        if not isinstance(found, Sequence) or not all(isinstance(grasp, Grasp) for grasp in found):
            yield f"{case.name}: plan returns {type(found).__name__}, not a sequence of Grasp"
            continue
        for number, grasp in enumerate(found):
            yield from (f"{case.name}, grasp {number}: {fault}" for fault in _grasp_faults(grasp, case.arguments["requirement"]))


def leeway(trial: Trial) -> Iterable[str]:
    """What a grasp stands for keeps the requirement too: the ends of each range do."""
    for case, found in trial.answers():
        for number, grasp in enumerate(found):
            name = f"{case.name}, grasp {number}"
            if grasp.leeway is None:
                continue
            if not _is_leeway(grasp.leeway):
                yield f"{name}: its leeway is no finite array (4, 2) of ranges from … to that hold 0"
                continue
            for end in (0, 1):
                there = dataclasses.replace(grasp, X_CG=grasp.X_CG @ moved(grasp.leeway[None, :, end])[0])
                faults = _grasp_faults(there, case.arguments["requirement"])
                yield from (f"{name}, at the end of its leeway: {fault}" for fault in faults)


def _is_leeway(value: Any) -> bool:
    if not (isinstance(value, np.ndarray) and value.shape == (4, 2) and np.isfinite(value).all()):
        return False
    return bool((value[:, 0] <= 0.0).all() and (value[:, 1] >= 0.0).all())


def _grasp_faults(grasp: Grasp, asked: GripRequirement) -> Iterable[str]:
    if not is_rigid(grasp.X_CG):
        yield "X_CG is not rigid"
        return
    if (grasp.gripper_type, grasp.grip) != (asked.gripper_type, asked.grip):
        yield f"is {grasp.gripper_type} {grasp.grip}, asked for was {asked.gripper_type} {asked.grip}"
    if not is_length(grasp.opening_width_mm) or not 0.5 < grasp.opening_width_mm / asked.opening_width_mm < 2.0:
        yield f"opens {grasp.opening_width_mm} mm, asked for were {asked.opening_width_mm:g} mm"
    if len(asked.approach_C) and (asked.approach_C @ grasp.X_CG[:3, 2]).max() < _ALONG:
        yield "its z points along none of the directions that the requirement allows"
    if len(asked.grip_axes_C) and np.abs(asked.grip_axes_C @ grasp.X_CG[:3, 0]).max() < _ALONG:
        yield "its x lies along none of the axes that the requirement allows"


CHECKS = (
    Check("grasps", "grasps are rigid and keep the requirement", grasps),
    Check("leeway", "what a grasp stands for keeps the requirement", leeway),
)
