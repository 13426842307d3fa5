"""The design folder of INTERFACE.md, as bytes by path."""

import json
from collections.abc import Mapping

from gripwright.cad.export import step_bytes, stl_bytes, threemf_bytes
from gripwright.cad.glb import GlbPart, glb_bytes
from gripwright.design.gripper_assembly import gripper_parts
from gripwright.design.result import DesignResult
from gripwright.design.stages.bom import bom_csv
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.gripper import Gripper
from gripwright.plugin_api import HandModel
from gripwright.report.page import report_page


def design_folder(result: DesignResult, hands: Mapping[str, HandModel]) -> dict[str, bytes]:
    """Every file of the folder; the same result gives the same bytes."""
    files: dict[str, bytes] = {
        "design.json": json.dumps(result.document, indent=1, allow_nan=False, ensure_ascii=False).encode(),
        "bom.csv": bom_csv(result.bom).encode(),
        "report.html": report_page(result, hands).encode(),
    }
    for gripper, cad in zip(result.grippers, result.cads, strict=True):
        if isinstance(cad, GripperCad):
            made = _gripper_files(gripper, cad, result, hands[gripper.gripper_type])
            files |= {f"grippers/{gripper.id}/{name}": data for name, data in made.items()}
    return files


def _gripper_files(gripper: Gripper, cad: GripperCad, result: DesignResult, hand: HandModel) -> dict[str, bytes]:
    product = f"{result.task.part_number}-{result.task.revision}"
    name = f"{product}-{gripper.id}-finger"
    made = {
        "finger.step": step_bytes(cad.finger.brep, name=name, part_number=name, description=f"finger of gripper {gripper.id}"),
        "finger.stl": stl_bytes(cad.finger.mesh),
        "finger.3mf": threemf_bytes(cad.finger.mesh, name),
        "body.stl": stl_bytes(cad.body),
    }
    parts = gripper_parts(gripper, hand, cad.finger.mesh, cad.measures, cad.spec.jaw, gripper.opening_max_mm)
    made["gripper.glb"] = glb_bytes([GlbPart(name=part.name, mesh=part.mesh, colour=part.colour) for part in parts])
    return made
