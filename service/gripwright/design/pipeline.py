"""The pipeline, as a whole: which stage runs on what."""

import dataclasses
from collections import Counter
from collections.abc import Container, Mapping, Sequence
from typing import Any

import numpy as np

from gripwright.design import catalogue
from gripwright.design.analysis import AnalysedMesh, analyse
from gripwright.design.barred import fingers_kind
from gripwright.design.plan import Plan
from gripwright.design.runner import Ref, Runner
from gripwright.design.step_values import HouseActuators
from gripwright.domain.assembly import AssemblyTask, Component, Operation
from gripwright.domain.errors import Fault, InvalidInput, Rejection
from gripwright.domain.gripper import FINGER_TOO_HEAVY, Actuator, Gripper, without_handles
from gripwright.domain.shape import Mesh

_HEAVIEST_ALONE, _ATTEMPTS, _HALVES = 2, 6, 4
"""So many grippers of a kind that cannot be made lose the grasp that bends them most; further ones all that bends more than such
fingers bear, found by halving the force so often; and from the last on an operation is given up for the kind."""

_FLAT = "straight"  # the finger designer that shapes no tips

_NO_MESH = Mesh(vertices_mm=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int64))


def design(task: AssemblyTask, actuators: Sequence[Actuator], plan: Plan, runner: Runner) -> Ref:
    """The whole job: from an assembly task and a catalogue to a `DesignResult`."""
    usable = catalogue.select(actuators, plan.actuators)
    unavailable = catalogue.unavailable(actuators, plan.actuators)
    said: dict[str, Any] = {}
    if plan.policies:
        (opinion,) = runner.map("policies", [{"actuators": _ref(runner.put(usable))}])
        house: HouseActuators = runner.get(opinion)
        said, usable = {"house": _ref(opinion)}, house.allowed
        unavailable |= {actuator.name: why for actuator, why in house.refused}
    chosen = _ref(runner.put(usable))
    owned = _ref(_owned(actuators, plan, runner))
    meshes = [runner.put(component.mesh) for component in task.components]
    shapes = analyse(meshes, plan, runner)
    _require_segments(task.components, [shapes[mesh].analysis for mesh in meshes])
    parts = _participants(task, meshes, shapes, runner)
    scenes = [_operation_inputs(operation, task, parts, runner) for operation in task.operations]
    verdicts = _refs(runner.map("constraints", [{**scene, "actuators": chosen, "owned": owned} for scene in scenes]))
    skeleton = _ref(runner.put(_without_meshes(task)))
    judged = {
        operation.id: {"operation": scene, "verdict": verdict}
        for operation, scene, verdict in zip(task.operations, scenes, verdicts, strict=True)
    }
    problem = {"task": skeleton, "verdicts": verdicts, "actuators": chosen, "owned": owned, **said}
    selection, cads = _grippers(problem, None if plan.finger == _FLAT else judged, runner)
    grippers: Sequence[Gripper] = runner.get(selection).grippers
    given = [_ref(runner.put(gripper)) for gripper in grippers]
    checks = runner.map(
        "verify",
        [
            {"gripper": ref, "cad": cad, "operations": [judged[handle.operation]["operation"] for handle in gripper.handles]}
            for gripper, ref, cad in zip(grippers, given, _refs(cads), strict=True)
        ],
    )
    (result,) = runner.map(
        "result",
        [
            {
                "task": skeleton,
                "analyses": [part["analysis"] for part in parts.values()],
                "verdicts": verdicts,
                "selection": _ref(selection),
                "cads": _refs(cads),
                "checks": _refs(checks),
                "unavailable": _ref(runner.put(unavailable)),
            }
        ],
    )
    return result


def _grippers(
    problem: Mapping[str, Any], shaping: Mapping[str, Mapping[str, Any]] | None, runner: Runner
) -> tuple[Ref, list[Ref]]:
    """The gripper set and the CAD of each gripper (None: it is owned); `shaping`: what shapes the tips, by operation.

    Where the finger is too heavy for its actuator, that one is offered with shorter fingers alone, and the set is chosen again.
    Where no finger can be made for what a gripper has to bear, its heaviest grasp is barred, and with it all of the same kind
    of fingers that bend them more in that operation, and the set is chosen again: see `_given_up`.
    """
    barred: dict[str, dict[str, Any]] = {}
    too_heavy: dict[str, dict[str, Any]] = {}
    attempts: Counter[str] = Counter()
    while True:
        (selection,) = runner.map("select", [{**problem, "barred": barred, "too_heavy": too_heavy}])
        if shaping is not None:
            selection = _with_tips(selection, shaping, runner)
        grippers: Sequence[Gripper] = runner.get(selection).grippers
        cads = _cads(grippers, runner.get(selection).owned, runner)
        refused = [
            (gripper, cad) for gripper, cad in zip(grippers, map(runner.get, cads), strict=True) if isinstance(cad, Rejection)
        ]
        attempts.update({fingers_kind(gripper) for gripper, _ in refused})
        if not refused or max(attempts.values()) > _ATTEMPTS + len(problem["verdicts"]):
            return selection, cads
        for gripper, cad in refused:
            kind = fingers_kind(gripper)
            if cad.code == FINGER_TOO_HEAVY:
                limit = {"finger_length": 0.0 if attempts[kind] >= _ATTEMPTS else gripper.finger_length_mm, "detail": cad.detail}
                too_heavy = {**too_heavy, gripper.actuator.name: limit}
                continue
            for operation, bending in _given_up(gripper, attempts[kind], runner).items():
                barred = {**barred, operation: {**barred.get(operation, {}), kind: {"bending": bending, "detail": cad.detail}}}


def _given_up(gripper: Gripper, attempt: int, runner: Runner) -> dict[str, float]:
    """From which `FreeGrasp.bending_Nmm` on grasps are barred, by operation, where no finger can be made for a gripper."""
    heaviest = max(gripper.handles, key=lambda handle: handle.bending_Nmm)
    if attempt <= _HEAVIEST_ALONE:
        return {heaviest.operation: heaviest.bending_Nmm}
    needed_N = max(handle.hold.required_force_N for handle in gripper.handles)
    shares = [0.5**k for k in range(_HALVES + 1)]
    alone = _ref(runner.put(without_handles(gripper)))
    cads = runner.map("fingers", [{"gripper": alone, "required_force": share * needed_N} for share in shares])
    unborne = min(share for share, cad in zip(shares, cads, strict=True) if isinstance(runner.get(cad), Rejection))
    if attempt < _ATTEMPTS:
        return {heaviest.operation: unborne * heaviest.bending_Nmm}
    given_up = gripper.handles if unborne == shares[-1] else (heaviest,)
    return {handle.operation: 0.0 for handle in given_up}


def _with_tips(selection: Ref, shaping: Mapping[str, Mapping[str, Any]], runner: Runner) -> Ref:
    """The selection, the tips of its new grippers shaped where that keeps every promise."""
    chosen = runner.get(selection)
    new = [gripper for gripper in chosen.grippers if gripper.id not in chosen.owned]
    inputs = [
        {
            "gripper": _ref(runner.put(gripper)),
            "operations": [shaping[handle.operation]["operation"] for handle in gripper.handles],
            "verdicts": [shaping[handle.operation]["verdict"] for handle in gripper.handles],
        }
        for gripper in new
    ]
    shaped = dict(zip((gripper.id for gripper in new), map(runner.get, runner.map("tips", inputs)), strict=True))
    return runner.put(dataclasses.replace(chosen, grippers=tuple(shaped.get(gripper.id, gripper) for gripper in chosen.grippers)))


def _cads(grippers: Sequence[Gripper], owned: Container[str], runner: Runner) -> list[Ref]:
    new = [gripper for gripper in grippers if gripper.id not in owned]
    made = runner.map("fingers", [_bearing(gripper, runner) for gripper in new])
    of_gripper = dict(zip((gripper.id for gripper in new), made, strict=True))
    nothing = runner.put(None)
    return [of_gripper.get(gripper.id, nothing) for gripper in grippers]


def _bearing(gripper: Gripper, runner: Runner) -> dict[str, Any]:
    """What fingers depend on: the gripper, and of all that it handles the greatest force."""
    needed = max((handle.hold.required_force_N for handle in gripper.handles), default=0.0)
    return {"gripper": _ref(runner.put(without_handles(gripper))), "required_force": needed}


def _owned(actuators: Sequence[Actuator], plan: Plan, runner: Runner) -> Ref:
    """The grippers that are at hand, their actuators from the whole catalogue."""
    if not plan.owned:
        return runner.put(())
    (owned,) = runner.map("owned", [{"actuators": _ref(runner.put(tuple(actuators)))}])
    return owned


def _require_segments(components: Sequence[Component], answers: Sequence[Any]) -> None:
    """InvalidInput that names every component of which the plan's segmenter makes no segments."""
    faults = tuple(
        Fault(pointer=f"/components/{k}", message=f"component {component.id!r}: {answer.detail}")
        for k, (component, answer) in enumerate(zip(components, answers, strict=True))
        if isinstance(answer, Rejection)
    )
    if faults:
        raise InvalidInput("the segmenter of the plan does not do for every component", faults=faults)


def _participants(
    task: AssemblyTask, meshes: Sequence[Ref], shapes: Mapping[Ref, AnalysedMesh], runner: Runner
) -> dict[str, dict[str, Any]]:
    """What operations know of each component, by component id."""
    skeletons = [_ref(runner.put(without_mesh(component))) for component in task.components]
    analyses = [{"ref": shapes[mesh].analysis} for mesh in meshes]
    grips = runner.map("grips", [{"component": c, "analysis": a} for c, a in zip(skeletons, analyses, strict=True)])
    return {
        component.id: {"component": skeleton, "prepared": _ref(shapes[mesh].prepared), "analysis": analysis, "grips": _ref(grip)}
        for component, skeleton, mesh, analysis, grip in zip(task.components, skeletons, meshes, analyses, grips, strict=True)
    }


def _operation_inputs(
    operation: Operation, task: AssemblyTask, parts: Mapping[str, Mapping[str, Any]], runner: Runner
) -> dict[str, Any]:
    """Everything that stands around in one operation."""
    around = [obstacle for obstacle in task.obstacles if obstacle.operations is None or operation.id in obstacle.operations]
    return {
        "operation": _ref(runner.put(operation)),
        "active": [dict(parts[name]) for name in operation.active],
        "passive": [{key: parts[name][key] for key in ("component", "prepared", "grips")} for name in operation.passive],
        "obstacles": [_ref(runner.put(obstacle)) for obstacle in around],
    }


def without_mesh(component: Component) -> Component:
    """A component as refs and skeletons hold it: its mesh is stored apart."""
    return dataclasses.replace(component, mesh=_NO_MESH)


def _without_meshes(task: AssemblyTask) -> AssemblyTask:
    components = tuple(without_mesh(component) for component in task.components)
    return dataclasses.replace(task, components=components)


def _ref(ref: Ref) -> dict[str, Ref]:
    return {"ref": ref}


def _refs(refs: Sequence[Ref]) -> list[dict[str, Ref]]:
    return [_ref(ref) for ref in refs]
