"""Checks of grasp planners: rigid poses that keep the requirement."""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, EXTERNAL, PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import is_rigid, moved, rotation_z
from gripwright.geometry.solids import box_vertices, prism_vertices
from gripwright.plugin_api import Params
from gripwright.testing.primitives import centric_requirement, parallel_requirement
from gripwright.testing.samples import TILTED, sample_components
from gripwright.testing.trial import Case, Check, Trial, is_length

_ALONG = np.cos(np.radians(1.0))


class SampleHand:
    """Straight fingers of 8 × 10 mm before a round palm."""

    key = "sample"
    params_model = Params

    def __init__(self, gripper_type: str, fingers: int) -> None:
        self.gripper_type, self.fingers = gripper_type, fingers

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """X_GF, evenly about z."""
        found = np.stack([rotation_z(2.0 * np.pi * k / self.fingers) for k in range(self.fingers)])
        found[:, :3, 3] = found[:, :3, 0] * (opening_width_mm / 2.0)
        return found

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """One box."""
        low, high = (0.0, 8.0) if grip == EXTERNAL else (-8.0, 0.0)
        corners = box_vertices(np.array([low, -5.0, -finger_length_mm]), np.array([high, 5.0, 0.0]))
        return (ConvexSolid(vertices_mm=corners, role="finger"),)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """One prism."""
        corners = prism_vertices(envelope_mm, -finger_length_mm - depth_mm, -finger_length_mm)
        return (ConvexSolid(vertices_mm=corners, role="palm"),)

    def opening_floor_mm(self, grip: str) -> float:
        """Where fingers of that section meet."""
        return 6.0 if grip == EXTERNAL else 22.0


def cases(plugin: Any) -> list[Case]:
    """A shaft for centric grippers, a box for parallel ones, both for a type that is not known here."""
    samples = {sample.name: sample for sample in sample_components()}
    found = []
    for gripper_type in sorted(plugin.gripper_types):
        hand = SampleHand(gripper_type, {PARALLEL_2: 2, CENTRIC_4: 4}.get(gripper_type, 3))
        for prefix, X_CB in (("", np.eye(4)), ("tilted ", TILTED)):
            asked = []
            if gripper_type != PARALLEL_2:
                asked.append(("stepped shaft", centric_requirement(X_CB, gripper_type)))
            if gripper_type not in (CENTRIC_3, CENTRIC_4):
                asked.append(("box with boss", parallel_requirement(X_CB, gripper_type)))
            for name, requirement in asked:
                sample = samples[prefix + name]
                arguments = {"component": sample.component, "segment": sample.segments[0], "requirement": requirement}
                found.append(Case(name=f"{prefix}{name}, {gripper_type}", method="plan", arguments={**arguments, "hand": hand}))
    return found


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
