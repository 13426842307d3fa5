"""The stages as steps that can be run anywhere: from values to values. Their keys are made of what `stage_table` says of them."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from gripwright.design import catalogue, tips
from gripwright.design.barred import without_barred
from gripwright.design.grooved_hand import hand_of
from gripwright.design.operation_steps import constraints, held_scene, participants
from gripwright.design.owned import owned_grippers
from gripwright.design.plan import Plan
from gripwright.design.result import DesignParts, DesignResult, design_result
from gripwright.design.scene_memory import SceneMemory
from gripwright.design.stage_table import StepFunction
from gripwright.design.stages import affordance, fingers, policies, rules, select, verify
from gripwright.design.stages.fit import fit
from gripwright.design.stages.keep import keep
from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.design.stages.segment import segment, source_labels
from gripwright.design.step_values import ComponentGrips, HouseActuators, PreparedShape, Segmentation
from gripwright.design.toolbox import Toolbox
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import INTERNAL, GripRequirement
from gripwright.domain.gripper import Gripper, without_handles
from gripwright.domain.shape import Analysis, Mesh
from gripwright.plugin_api import RunContext


def _owned(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> tuple[Gripper, ...]:
    return owned_grippers(plan.owned, inputs["actuators"], toolbox.hands)


def _policies(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> HouseActuators:
    return policies.house_actuators(inputs["actuators"], toolbox.policies)


def _prepare(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> PreparedShape:
    mesh: Mesh = inputs["mesh"]
    made = prepare(mesh, PrepareSettings(), ctx)
    return PreparedShape(
        mesh=made.mesh, solid=made.solid, file_faces=len(mesh.faces), warnings=made.warnings, timings=ctx.timings
    )


def _segment(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> Segmentation | Rejection:
    prepared: PreparedShape = inputs["prepared"]
    component = Component(id="", mesh=prepared.mesh, X_PC=np.eye(4))
    segments = segment(component, toolbox.segmenters[inputs["segmenter"]], ctx)
    if isinstance(segments, Rejection):
        return segments
    labels = source_labels(prepared.mesh, segments, prepared.file_faces)
    return Segmentation(
        segmenter=inputs["segmenter"],
        segments=segments,
        source_labels=labels,
        timings=ctx.timings,
        sdf=ctx.face_values.get("sdf"),
        remarks=tuple(ctx.remarks),
    )


def _fit(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> Analysis:
    prepared: PreparedShape = inputs["prepared"]
    segmentation: Segmentation = inputs["segmentation"]
    component = Component(id="", mesh=prepared.mesh, X_PC=np.eye(4))
    fitted = tuple(fit(component, item, toolbox.fitters, ctx) for item in segmentation.segments)
    return Analysis(
        mesh=prepared.mesh,
        source_labels=segmentation.source_labels,
        segments=fitted,
        segmenter=segmentation.segmenter,
        warnings=prepared.warnings,
        timings={**prepared.timings, **segmentation.timings, **ctx.timings},
        sdf=segmentation.sdf,
        remarks=segmentation.remarks,
    )


def _keep(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> Analysis:
    return keep(inputs["analyses"])


def _grips(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> ComponentGrips:
    analysis: Analysis = inputs["analysis"]
    component: Component = dataclasses.replace(inputs["component"], mesh=analysis.mesh)
    segments = [item.segment for item in analysis.segments]
    forbidden = affordance.forbidden(component, segments, {item.key: item for item in toolbox.affordance}, ctx)
    found: dict[int, tuple[GripRequirement, ...] | Rejection] = {}
    for item in analysis.segments:
        banned = affordance.segment_forbidden(component.mesh, item.segment, forbidden)
        if banned is not None:
            found[item.segment.id] = banned
            continue
        primitives = () if item.primitive is None else (item.primitive,)
        if plan.plan != "paper":
            primitives = (*primitives, *item.alternatives)
        needs = _requirements(primitives, item.reason, toolbox)
        if not isinstance(needs, Rejection):
            needs = policies.house_grips(component, item.segment, needs, forbidden, toolbox.policies)
        found[item.segment.id] = needs
    return ComponentGrips(forbidden=forbidden, segments=found)


def _requirements(primitives: Sequence[Any], reason: str, toolbox: Toolbox) -> tuple[GripRequirement, ...] | Rejection:
    if not primitives:
        return Rejection("no-type", reason)
    needs = rules.requirements(primitives, toolbox.rules)
    if isinstance(needs, Rejection):
        return needs
    return tuple(sorted(needs, key=lambda need: need.grip == INTERNAL))  # a bore only where nothing is held from outside


def _select(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> Any:
    verdicts = [without_barred(verdict, inputs["barred"].get(verdict.operation, {})) for verdict in inputs["verdicts"]]
    options = dataclasses.replace(select.options_of(plan), owned=inputs["owned"], too_heavy=inputs["too_heavy"])
    if "house" in inputs:
        house: HouseActuators = inputs["house"]
        options = dataclasses.replace(options, preferences=house.preferences, refused=house.refused)
    return select.select(inputs["task"], verdicts, inputs["actuators"], options, toolbox, ctx)


def _tips(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> Gripper:
    gripper: Gripper = inputs["gripper"]
    if gripper.gripper_type not in toolbox.fingers:
        return gripper
    places = []
    for handle, operation, verdict in zip(gripper.handles, inputs["operations"], inputs["verdicts"], strict=True):
        acted = {**operation, "operation": dataclasses.replace(operation["operation"], force_N=verdict.force_N)}
        held = next(item for item in participants(operation) if item.component.id == handle.component)
        scene, component = held_scene(acted, held, plan)
        (judged,) = (item for item in verdict.components[handle.component] if item.segment == handle.segment)
        places.append(tips.HandleScene(held=component, scene=scene, primitive=judged.requirement.primitive))
    return tips.with_shaped_tips(
        gripper,
        places,
        toolbox.fingers[gripper.gripper_type],
        toolbox.hands[gripper.gripper_type],
        catalogue.body_size(gripper.actuator),
        plan.safety_factor,
        dataclasses.replace(ctx, pad=plan.pad.made),
    )


def _fingers(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> Any:
    gripper: Gripper = inputs["gripper"]
    diameter, length = catalogue.body_size(gripper.actuator)
    if gripper.gripper_type not in toolbox.fingers:
        return Rejection("no-designer", f"the plan names no finger designer for {gripper.gripper_type}")
    return fingers.design_gripper_cad(
        gripper,
        toolbox.fingers[gripper.gripper_type],
        hand_of(gripper, toolbox.hands[gripper.gripper_type]),
        [],
        diameter,
        length,
        inputs["required_force"],
        plan.safety_factor,
        dataclasses.replace(ctx, pad=plan.pad.made),
        toolbox.holding,
    )


def _verify(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> tuple[verify.HandleReport, ...]:
    gripper: Gripper = inputs["gripper"]
    cad, reports = inputs["cad"], []
    for handle, operation in zip(gripper.handles, inputs["operations"], strict=True):
        if isinstance(cad, Rejection):
            reports.append(verify.HandleReport(operation=handle.operation, faults=(cad.detail,), gap_mm=None))
            continue
        held = next(item for item in participants(operation) if item.component.id == handle.component)
        scene, component = held_scene(operation, held, plan)
        hand, alone = hand_of(gripper, toolbox.hands[gripper.gripper_type]), without_handles(gripper)
        shapes = () if cad is None else (cad.finger.mesh, cad.body)
        check: Callable[..., verify.HandleReport] = verify.verify_handle if shapes else verify.verify_owned
        model = toolbox.holding.get(gripper.gripper_type)
        finds = partial(check, alone, handle, *shapes, hand, scene, component.solid, ctx, model)
        made_from = (alone, handle, shapes, component.solid)
        reports.append(SceneMemory(inputs["memory"], scene).answer("handle", made_from, finds))
        ctx.progress(len(reports) / len(gripper.handles), f"{gripper.id}: {handle.operation}")
    return tuple(reports)


def _result(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> DesignResult:
    return design_result(DesignParts(**inputs), plan, toolbox.versions)


FUNCTIONS: Mapping[str, StepFunction] = {
    "owned": _owned,
    "policies": _policies,
    "prepare": _prepare,
    "segment": _segment,
    "fit": _fit,
    "keep": _keep,
    "grips": _grips,
    "constraints": constraints,
    "select": _select,
    "tips": _tips,
    "fingers": _fingers,
    "verify": _verify,
    "result": _result,
}
"""What each stage of `stage_table` computes."""
