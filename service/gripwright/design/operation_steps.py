"""Operations in the stages: what a step's inputs say of one, and the step of its constraints."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gripwright.design import catalogue, scenes
from gripwright.design.component_search import ComponentSearch
from gripwright.design.gauge import Envelopes
from gripwright.design.grasp_judge import GraspJudge, HeldComponent
from gripwright.design.hand_check import OperationScene
from gripwright.design.memory import Memory
from gripwright.design.operation_class import OperationClass, PlacedComponent, beside, classify
from gripwright.design.overlap import deepest_overlap, swept_over
from gripwright.design.plan import Plan
from gripwright.design.scene_memory import SceneMemory
from gripwright.design.step_values import Participant
from gripwright.design.toolbox import Toolbox
from gripwright.domain.assembly import Obstacle, Operation
from gripwright.domain.grasp import OperationVerdict, SegmentVerdict
from gripwright.domain.gripper import Actuator, Gripper
from gripwright.domain.shape import FloatArray
from gripwright.plugin_api import RunContext


def constraints(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> OperationVerdict:
    """What holds each of the components that the operation moves, and what kind of operation it is."""
    operation: Operation = inputs["operation"]
    ctx = dataclasses.replace(ctx, pad=plan.pad.made)
    with ctx.timed("constraints.classify"):
        kind = _kind(operation, inputs)
        operation = _with_default_force(operation, kind, plan)
        warnings = _overlap_warnings(operation, inputs, plan)
    verdicts = _judged({**inputs, "operation": operation}, plan, toolbox, ctx)
    return OperationVerdict(
        operation=operation.id,
        components=verdicts,
        warnings=warnings,
        timings=ctx.timings,
        kind=kind.kind,
        evidence=kind.evidence,
        force_N=operation.force_N,
    )


def participants(inputs: Mapping[str, Any]) -> list[Participant]:
    """The components that the operation moves."""
    return [Participant(**item) for item in inputs["active"]]


def held_scene(inputs: Mapping[str, Any], held: Participant, plan: Plan) -> tuple[OperationScene, HeldComponent]:
    """The scene of an operation, and the held component, from a step's inputs."""
    operation: Operation = inputs["operation"]
    obstacles: Sequence[Obstacle] = inputs["obstacles"]
    body = scenes.Body(component=held.component, solid=held.prepared.solid)
    others = _bodies([item for item in inputs["active"] if item["component"].id != held.component.id])
    scene = scenes.operation_scene(
        operation, body, others, _bodies(inputs["passive"]), obstacles, plan.margin, plan.release_clearance
    )
    forbidden = held.grips.forbidden if held.grips is not None else ()
    return scene, scenes.held_component(operation, body, others, held.prepared.mesh, forbidden)


def _judged(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> dict[str, tuple[SegmentVerdict, ...]]:
    """How each segment of the components that may be held fares in the operation.

    Where no grasp that was planned is free, one component after the other is searched more finely.
    """
    operation: Operation = inputs["operation"]
    searches = {
        held.component.id: _search(inputs, held, plan, toolbox, ctx)
        for held in participants(inputs)
        if held.component.id in operation.graspable
    }
    verdicts = {component: search.planned() for component, search in searches.items()}
    finest = np.repeat([np.radians(plan.finest_rotation), plan.finest_step], 2)
    for component, search in searches.items():
        if not any(verdict.free for found in verdicts.values() for verdict in found):
            verdicts[component] = search.between(finest)
    return verdicts


def _search(inputs: Mapping[str, Any], held: Participant, plan: Plan, toolbox: Toolbox, ctx: RunContext) -> ComponentSearch:
    assert held.analysis is not None
    assert held.grips is not None
    scene, component = held_scene(inputs, held, plan)
    return ComponentSearch(
        judge=GraspJudge(component, scene, _envelopes(inputs["actuators"], inputs["owned"]), ctx, toolbox.holding),
        asked=[(item, held.grips.segments[item.segment.id]) for item in held.analysis.segments],
        known=SceneMemory(inputs["memory"], scene),
        grippers=(inputs["actuators"], inputs["owned"]),
        toolbox=toolbox,
        ctx=ctx,
    )


def _kind(operation: Operation, inputs: Mapping[str, Any]) -> OperationClass:
    active, passive = _marked(inputs["active"]), _marked(inputs["passive"])
    made_from = (operation.motion, operation.fit, active, beside(operation.motion, active, passive), not passive)
    memory: Memory = inputs["memory"]
    return memory.part("kind", made_from, lambda: classify(operation.motion, operation.fit, active, passive))


def _marked(items: Sequence[Mapping[str, Any]]) -> list[PlacedComponent]:
    return [
        PlacedComponent(
            id=item["component"].id,
            mesh=item["prepared"].mesh,
            X_PC=item["component"].X_PC,
            forbidden=item["grips"].forbidden,
        )
        for item in items
    ]


def _with_default_force(operation: Operation, kind: OperationClass, plan: Plan) -> Operation:
    """The operation with the insertion force of its kind, where the package states none; the paper knows none."""
    if operation.force_N > 0.0 or plan.plan == "paper":
        return operation
    return dataclasses.replace(operation, force_N=kind.default_force_N)


def _overlap_warnings(operation: Operation, inputs: Mapping[str, Any], plan: Plan) -> tuple[str, ...]:
    active, passive = _bodies(inputs["active"]), _bodies(inputs["passive"])
    near = swept_over(operation.motion, active, passive)
    memory: Memory = inputs["memory"]
    (found,) = memory.part(
        "overlap", (operation.motion, active, near), lambda: (deepest_overlap(operation.motion, active, near),)
    )
    if found is None or found.depth_mm <= plan.contact_tolerance or operation.fit == "press":
        return ()
    return (f"{operation.id}: {found}; its grasps are judged all the same",)


def _envelopes(actuators: Sequence[Actuator], owned: Sequence[Gripper]) -> Envelopes:
    """The palm envelopes, rounded up to rungs, of the actuators and of the owned grippers that may hold a width."""

    def of(gripper_type: str, opening_width_mm: float) -> FloatArray:
        needed = [
            catalogue.palm_envelope_mm(actuator, opening_width_mm + actuator.stroke_mm)
            for actuator in actuators
            if actuator.gripper_type == gripper_type
        ]
        needed += [gripper.envelope_mm for gripper in owned if gripper.gripper_type == gripper_type]
        ladder = catalogue.envelope_ladder(max(needed, default=0.0))
        return ladder[np.unique(np.searchsorted(ladder, np.array(needed) - 1e-9))] if needed else np.zeros(0)

    return of


def _bodies(items: Sequence[Mapping[str, Any]]) -> list[scenes.Body]:
    return [scenes.Body(component=item["component"], solid=item["prepared"].solid) for item in items]
