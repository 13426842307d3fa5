"""The design folder of INTERFACE.md, as bytes by path; components in colour beside it, for whoever shows them."""

import json
from collections.abc import Iterator, Mapping

import numpy as np

from gripwright.cad.colour import component_glb, segment_colours, value_colours
from gripwright.cad.glb import GlbPart, glb_bytes
from gripwright.design.bom_forms import bom_csv, bom_views
from gripwright.design.gripper_assembly import gripper_parts
from gripwright.design.memory import Memory
from gripwright.design.result import DesignResult
from gripwright.design.stages.bom import finger_part_number, pad_part_number
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.gripper import BondedFinger, Gripper, second_part, without_handles
from gripwright.domain.shape import Analysis
from gripwright.geometry.shape_diameter import shape_diameters_mm
from gripwright.plugin_api import HandModel
from gripwright.report.page import report_page
from gripwright.report.tool_data import gripper_urdf, tool_json
from gripwright.report.views import design_views
from gripwright.report.workbook import bom_workbook

_RAYS, _CONE_RAD = 30, float(np.radians(120.0))


def design_folder(result: DesignResult, hands: Mapping[str, HandModel], memory: Memory) -> dict[str, bytes]:
    """Every file of the folder; the same result gives the same bytes."""
    bills = bom_views(result.document, result.bom)
    files: dict[str, bytes] = {
        "design.json": json.dumps(result.document, indent=1, allow_nan=False, ensure_ascii=False).encode(),
        **{f"{name}.csv": bom_csv(rows, columns).encode() for name, (columns, rows) in bills.items()},
        "bom.xlsx": bom_workbook({name: rows for name, (_, rows) in bills.items()}),
        "report.html": report_page(result, design_views(result, hands, memory)).encode(),
    }
    for gripper, cad in zip(result.grippers, result.cads, strict=True):
        if isinstance(cad, GripperCad):
            made = _gripper_files(without_handles(gripper), cad, result, hands[gripper.gripper_type], memory)
            files |= {f"grippers/{gripper.id}/{name}": data for name, data in made.items()}
    return files | dict(_component_files(result, memory))


def _gripper_files(gripper: Gripper, cad: GripperCad, result: DesignResult, hand: HandModel, memory: Memory) -> dict[str, bytes]:
    name = f"{result.task.part_number}-{result.task.revision}-{gripper.id}-{cad.finger.name.replace(' ', '-')}"
    return memory.part("gripper", (gripper, cad, name), lambda: _files_of(gripper, cad, name, hand))


def _files_of(gripper: Gripper, cad: GripperCad, name: str, hand: HandModel) -> dict[str, bytes]:
    """The files of a gripper, whatever it handles, by their names."""
    from gripwright.cad.export import step_bytes, stl_bytes, threemf_bytes  # with the CAD kernel, which takes most of a second
    from gripwright.report.drawing import finger_drawing

    number, called = finger_part_number(cad.finger), cad.finger.name  # as in the bill of materials
    parts = gripper_parts(gripper, hand, cad.finger, cad.measures, cad.spec.jaw, gripper.opening_max_mm)
    bonded = {} if cad.finger.bonded is None else _bonded_files(cad.finger.bonded, name, number, called)
    return bonded | {
        "finger.step": step_bytes(
            cad.finger.brep, name=name, part_number=number, description=f"{called} of gripper {gripper.id}"
        ),
        "finger.stl": stl_bytes(cad.finger.mesh),
        "finger.3mf": threemf_bytes(cad.finger.mesh, name),
        "finger.svg": finger_drawing(cad, title=f"{called.capitalize()} of gripper {gripper.id}", part_number=number).encode(),
        "body.stl": stl_bytes(cad.body),
        "body.step": step_bytes(cad.body_brep, name=f"{gripper.id}-body", part_number=gripper.actuator.name),
        "gripper.glb": glb_bytes([GlbPart(name=part.name, mesh=part.mesh, colour=part.colour) for part in parts]),
        "tool.json": tool_json(gripper, cad).encode(),
        "gripper.urdf": gripper_urdf(gripper, cad, hand).encode(),
    }


def _bonded_files(bonded: BondedFinger, name: str, number: str, called: str) -> dict[str, bytes]:
    """The two parts that are bonded to a finger: `finger.*` show them together."""
    from gripwright.cad.export import step_bytes, stl_bytes, threemf_bytes

    bare, pad = f"{name}-bare", f"{name}-pad"
    return {
        "finger_bare.step": step_bytes(
            bonded.bare.brep, name=bare, part_number=number, description=f"{called} without its {second_part(bonded)}"
        ),
        "finger_bare.stl": stl_bytes(bonded.bare.mesh),
        "finger_bare.3mf": threemf_bytes(bonded.bare.mesh, bare),
        "pad.step": step_bytes(bonded.pad.brep, name=pad, part_number=pad_part_number(bonded), description=bonded.pad.material),
        "pad.stl": stl_bytes(bonded.pad.mesh),
    }


def _component_files(result: DesignResult, memory: Memory) -> Iterator[tuple[str, bytes]]:
    """Each component coloured by segment and by shape diameter; what components share is made once."""
    made: dict[int, tuple[bytes, bytes]] = {}
    for component, analysis in zip(result.task.components, result.analyses, strict=True):
        if id(analysis) not in made:
            made[id(analysis)] = _coloured(component.id, analysis, memory)
        by_segment, by_diameter = made[id(analysis)]
        yield f"components/{component.id}.segment.glb", by_segment
        yield f"components/{component.id}.sdf.glb", by_diameter


def _coloured(name: str, analysis: Analysis, memory: Memory) -> tuple[bytes, bytes]:
    labels = analysis.face_labels

    def made() -> tuple[bytes, bytes]:
        diameters = shape_diameters_mm(analysis.mesh, _RAYS, _CONE_RAD) if analysis.sdf is None else analysis.sdf
        return (
            component_glb(name, analysis.mesh, segment_colours(labels)),
            component_glb(name, analysis.mesh, value_colours(diameters)),
        )

    return memory.part("component", (name, analysis.mesh, labels, analysis.sdf), made)
