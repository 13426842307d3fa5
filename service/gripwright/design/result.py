"""The answer of a design: the document of INTERFACE.md and everything that the design folder is made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gripwright.design.miss_document import miss_document, tip_document
from gripwright.design.pad_pressure import pad_compression, pad_warnings
from gripwright.design.plan import Plan, without_effect
from gripwright.design.shortfall import closest_segment
from gripwright.design.stages.bom import BomRow, bom
from gripwright.design.stages.fingers import GripperCad
from gripwright.design.stages.select import Selection
from gripwright.design.stages.verify import HandleReport
from gripwright.design.toolbox import PluginVersion
from gripwright.domain.assembly import AssemblyTask, Component, Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import FreeGrasp, OperationVerdict, SegmentVerdict
from gripwright.domain.gripper import Gripper, Handle
from gripwright.domain.shape import Analysis, SegmentAnalysis

_FILES = (
    "finger.stl",
    "finger.step",
    "finger.3mf",
    "finger.svg",
    "body.stl",
    "body.step",
    "gripper.glb",
    "gripper.urdf",
    "tool.json",
)
"""Of each gripper whose CAD is made."""
_BONDED_FILES = ("finger_bare.step", "finger_bare.stl", "finger_bare.3mf", "pad.step", "pad.stl")
"""Besides, where its fingers carry pads: the two parts that are bonded to a finger."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignResult:
    """Everything that is known at the end. `document` is design.json; components of `task` carry no mesh."""

    document: dict[str, Any]
    task: AssemblyTask
    analyses: tuple[Analysis, ...]  # one a component, in the task's order
    grippers: tuple[Gripper, ...]
    cads: tuple[GripperCad | Rejection | None, ...]  # one a gripper; None: it is owned
    bom: tuple[BomRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignParts:
    """What the stages found, gathered."""

    task: AssemblyTask
    analyses: Sequence[Analysis]
    verdicts: Sequence[OperationVerdict]
    selection: Selection
    cads: Sequence[GripperCad | Rejection | None]
    checks: Sequence[Sequence[HandleReport]]  # one a gripper, one a handle
    unavailable: Mapping[str, Rejection]  # actuator of the catalogue that the plan does not use → why not


def design_result(parts: DesignParts, plan: Plan, versions: Mapping[str, PluginVersion]) -> DesignResult:
    """Put the findings of all stages together."""
    operations = _operations(parts)
    components = [
        _component(component, analysis, parts, operations)
        for component, analysis in zip(parts.task.components, parts.analyses, strict=True)
    ]
    complete = all(operation["status"] == "covered" for operation in operations.values())
    fingers = {
        gripper.id: cad.finger
        for gripper, cad in zip(parts.selection.grippers, parts.cads, strict=True)
        if isinstance(cad, GripperCad)
    }
    rows = tuple(bom(parts.task, parts.selection.grippers, fingers, parts.selection.owned))
    document = {
        "product": {"part_number": parts.task.part_number, "revision": parts.task.revision, "name": parts.task.name},
        "status": "complete" if complete else "incomplete",
        "operations": list(operations.values()),
        "components": components,
        "grippers": [
            {
                **_gripper(gripper, cad, checks, parts.selection.owned.get(gripper.id)),
                "not_chosen": _not_chosen(parts, gripper.id),
                "remarks": list(parts.selection.remarks.get(gripper.id, ())),
            }
            for gripper, cad, checks in zip(parts.selection.grippers, parts.cads, parts.checks, strict=True)
        ],
        "optimum": parts.selection.optimum,
        "bom": [row.to_dict() for row in rows],
        "warnings": [*without_effect(plan, versions), *_warnings(parts)],
        "plan": {"options": plan.model_dump(mode="json"), "plugins": {key: dict(value) for key, value in versions.items()}},
        "timings": _timings(parts),
    }
    return DesignResult(
        document=document,
        task=parts.task,
        analyses=tuple(parts.analyses),
        grippers=parts.selection.grippers,
        cads=tuple(parts.cads),
        bom=rows,
    )


def _operations(parts: DesignParts) -> dict[str, dict[str, Any]]:
    """Each operation by id: covered by a verified handle, or why not."""
    handled: dict[str, tuple[Gripper, Handle, HandleReport]] = {}
    for gripper, checks in zip(parts.selection.grippers, parts.checks, strict=True):
        for handle, check in zip(gripper.handles, checks, strict=True):
            handled[handle.operation] = (gripper, handle, check)
    kinds = {verdict.operation: verdict for verdict in parts.verdicts}
    return {
        operation.id: {
            **_operation(operation, handled.get(operation.id), parts),
            "kind": kinds[operation.id].kind,
            "evidence": kinds[operation.id].evidence,
            "force": kinds[operation.id].force_N,
            "owned_that_hold": list(parts.selection.owned_that_hold.get(operation.id, ())),
        }
        for operation in parts.task.operations
    }


def _operation(operation: Operation, handled: tuple[Gripper, Handle, HandleReport] | None, parts: DesignParts) -> dict[str, Any]:
    answer: dict[str, Any] = {"id": operation.id, "status": "uncovered", "component": None, "gripper": None, "detail": None}
    answer["nearest_miss"] = None
    if handled is None:
        default = "the optimiser left the operation uncovered"
        nearest = next((closest_segment(verdict) for verdict in parts.verdicts if verdict.operation == operation.id), None)
        if nearest is not None:
            answer["nearest_miss"] = {"component": nearest.component, "segment": nearest.segment, **miss_document(nearest.miss)}
        return {**answer, "detail": parts.selection.not_covered.get(operation.id, default)}
    gripper, handle, check = handled
    answer |= {"component": handle.component, "gripper": gripper.id}
    if check.faults:
        return {**answer, "detail": "the finished CAD fails its check: " + "; ".join(check.faults)}
    return {**answer, "status": "covered"}


def _component(
    component: Component, analysis: Analysis, parts: DesignParts, operations: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    moved = [operations[item.id] for item in parts.task.operations if component.id in item.active]
    failed = [item for item in moved if item["status"] != "covered"]
    status = "not_moved" if not moved else ("uncovered" if failed else "covered")
    verdicts = [verdict.components[component.id] for verdict in parts.verdicts if component.id in verdict.components]
    judged = {verdict.segment: verdict for verdict in (verdicts[0] if verdicts else ())}
    return {
        "id": component.id,
        "status": status,
        "detail": failed[0]["detail"] if failed else None,
        "segmenter": analysis.segmenter,
        "remarks": list(analysis.remarks),
        "segments": [_segment(item, analysis, judged.get(item.segment.id)) for item in analysis.segments],
    }


def _segment(item: SegmentAnalysis, analysis: Analysis, verdict: SegmentVerdict | None) -> dict[str, Any]:
    need = verdict.requirement if verdict is not None else None
    free = verdict.free if verdict is not None else ()
    rejection = verdict.rejection if verdict is not None else Rejection("not-moved", "no operation moves this component")
    lengths = [float(grasp.finger_length_min_mm.min()) for grasp in free]
    longest = max((grasp.finger_length_max_mm for grasp in free), default=0.0)
    return {
        **segment_shape(item, analysis),
        "gripper_type": need.gripper_type if need is not None else None,
        "grip": need.grip if need is not None else None,
        "rule": need.rule if need is not None else None,
        "held_primitive": need.primitive.kind if need is not None else None,
        "opening_width": _opening(free, verdict),
        **(tip_document(need.taper_rad, need.vee) if need is not None else {}),
        "finger_length_min": _mm(min(lengths)) if lengths else None,
        "finger_length_max": _mm(longest) if free and np.isfinite(longest) else None,
        "graspable": bool(free),
        "rejection": rejection.code if rejection is not None else None,
        "detail": rejection.detail if rejection is not None else None,
        "nearest_miss": miss_document(verdict.nearest_miss) if verdict is not None and verdict.nearest_miss is not None else None,
        "grasps_planned": verdict.grasps_planned if verdict is not None else 0,
        "grasps_free": len(free),
    }


def _opening(free: Sequence[FreeGrasp], verdict: SegmentVerdict | None) -> float | None:
    if free:
        return _mm(free[0].grasp.opening_width_mm)
    return _mm(verdict.requirement.opening_width_mm) if verdict is not None and verdict.requirement is not None else None


def segment_shape(item: SegmentAnalysis, analysis: Analysis) -> dict[str, Any]:
    """What is known of a segment before any assembly, as JSON: mm, the component's frame."""
    return {
        "id": item.segment.id,
        "faces": int((analysis.source_labels == item.segment.id).sum()),
        "area": _mm(item.segment.area_mm2),
        "hull_volume": _mm(item.segment.hull_volume_mm3),
        "primitive": _primitive(item),
        "reason": item.reason,
    }


def _primitive(item: SegmentAnalysis) -> dict[str, Any] | None:
    if item.primitive is None:
        return None
    hull = item.segment.hull_volume_mm3
    ratio = item.primitive.volume_mm3 / hull if hull > 0 else None
    return {"kind": item.primitive.kind, **item.primitive.to_dict(), "volume_ratio": ratio, "rms": item.primitive.rms_mm}


def _gripper(
    gripper: Gripper, cad: GripperCad | Rejection | None, checks: Sequence[HandleReport], owned: str | None
) -> dict[str, Any]:
    folder = f"grippers/{gripper.id}"
    made = cad if isinstance(cad, GripperCad) else None
    files = () if made is None else _FILES if made.finger.bonded is None else (*_FILES, *_BONDED_FILES)
    return {
        "id": gripper.id,
        "owned": owned,
        "gripper_type": gripper.gripper_type,
        "fingers": gripper.fingers,
        "grip": gripper.grip,
        "opening_min": _mm(gripper.opening_min_mm),
        "opening_max": _mm(gripper.opening_max_mm),
        "finger_length": _mm(gripper.finger_length_mm),
        "palm_radius": _mm(gripper.envelope_mm),
        **tip_document(gripper.taper_rad, gripper.vee),
        "actuator": {
            "maker": gripper.actuator.maker,
            "model": gripper.actuator.model,
            "stroke": gripper.actuator.stroke_mm,
            "grip_force": gripper.actuator.grip_force_N,
            "grip_force_max": made.grip_force_max_N if made is not None else None,
            "jaw_offset": _mm(gripper.jaw_offset_mm),
        },
        "files": {name.replace(".", "_"): f"{folder}/{name}" for name in files},
        "detail": cad.detail if isinstance(cad, Rejection) else None,
        "finger": None
        if made is None
        else {"material": made.finger.material, "mass": made.finger.mass_kg, **made.finger.properties},
        "handles": [_handle(handle, check, gripper, made) for handle, check in zip(gripper.handles, checks, strict=True)],
    }


def _not_chosen(parts: DesignParts, gripper_id: str) -> list[dict[str, str]]:
    """Each other actuator and why the gripper does not have it; of none where the gripper is owned."""
    reasons = {**parts.selection.not_chosen[gripper_id], **parts.unavailable} if gripper_id in parts.selection.not_chosen else {}
    return [{"actuator": name, "code": reason.code, "detail": reason.detail} for name, reason in sorted(reasons.items())]


def _handle(handle: Handle, check: HandleReport, gripper: Gripper, cad: GripperCad | None) -> dict[str, Any]:
    compression = None if cad is None else pad_compression(handle, cad)
    return {
        "operation": handle.operation,
        "component": handle.component,
        "segment": handle.segment,
        "opening_width": _mm(handle.opening_width_mm),
        "release_opening": _mm(handle.release_opening_mm),
        "contact_offset": _mm(handle.grasp.contact_offset_mm),
        "grasp_pose": np.round(handle.grasp.X_CG, 9).tolist(),
        "gap": None if check.gap_mm is None else _mm(check.gap_mm),
        "hold": {
            "grip_force": gripper.actuator.grip_force_N if handle.grip_force_N is None else _mm(handle.grip_force_N),
            "required_force": _mm(handle.hold.required_force_N),
            "safety_factor": None if handle.safety_factor is None else _mm(handle.safety_factor),
            "moment": _mm(handle.hold.moment_Nmm),
            "symmetry": _mm(handle.hold.symmetry),
            "contact_area": _mm(handle.hold.contact_area_mm2),
            "pad_compression": None if compression is None else round(compression, 4),
        },
        "grasp": handle.grasp.label,
        "verified": not check.faults,
    }


def _warnings(parts: DesignParts) -> list[str]:
    of_meshes = [
        f"{component.id}: {text}"
        for component, analysis in zip(parts.task.components, parts.analyses, strict=True)
        for text in analysis.warnings
    ]
    of_operations = (text for verdict in parts.verdicts for text in verdict.warnings)
    return [*parts.task.warnings, *of_meshes, *of_operations, *pad_warnings(parts.selection.grippers, parts.cads)]


def _timings(parts: DesignParts) -> dict[str, float]:
    """Seconds of work by stage and part, added up over components and operations (over all cores)."""
    total: dict[str, float] = {}
    distinct = {id(analysis): analysis for analysis in parts.analyses}
    for timings in [*(item.timings for item in distinct.values()), *(verdict.timings for verdict in parts.verdicts)]:
        for key, seconds in timings.items():
            total[key] = total.get(key, 0.0) + seconds
    return {key: round(value, 4) for key, value in sorted(total.items())}


def _mm(value: float) -> float:
    """A figure for the document: a tenth of a micrometre is enough."""
    return round(float(value), 4)
