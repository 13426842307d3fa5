"""What the service computes around the calculation: the design folder, an analysis as JSON, a proposed sequence."""

from collections.abc import Mapping
from typing import Any

from gripwright.design.hierarchy import joins
from gripwright.design.plan import Plan
from gripwright.design.result import segment_shape
from gripwright.design.scenes import Body
from gripwright.design.sequence_proposal import propose_sequence
from gripwright.design.stage_table import StepFunction
from gripwright.design.toolbox import Toolbox
from gripwright.domain.assembly import Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Analysis
from gripwright.plugin_api import RunContext
from gripwright.report.folder import design_folder


def export(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> dict[str, bytes]:
    """The files of the design folder by their paths."""
    del plan, ctx
    return design_folder(inputs["result"], toolbox.hands, inputs["memory"])


def describe_analysis(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> dict[str, Any]:
    """An analysis as JSON: `hierarchy` joins segments to coarser ones, `labels` is the segment of each face of the file."""
    del plan, toolbox, ctx
    analysis: Analysis = inputs["analysis"]
    return {
        "segmenter": analysis.segmenter,
        "faces": len(analysis.source_labels),
        "segments": [{**segment_shape(item, analysis), "fits": list(item.fits)} for item in analysis.segments],
        "hierarchy": [
            {"id": join.id, "children": list(join.children), "area": join.area_mm2, "border": join.border_mm}
            for join in joins(analysis.mesh, [item.segment for item in analysis.segments])
        ],
        "labels": analysis.source_labels,
        "warnings": list(analysis.warnings),
        "remarks": list(analysis.remarks),
        "timings": analysis.timings,
    }


def propose(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> tuple[Operation, ...] | Rejection:
    """An assembly sequence of components in their places, or why there is none."""
    del toolbox, ctx
    bodies = [Body(component=item["component"], solid=item["prepared"].solid) for item in inputs["components"]]
    return propose_sequence(bodies, plan.contact_tolerance)


FUNCTIONS: Mapping[str, StepFunction] = {"export": export, "describe": describe_analysis, "propose": propose}
"""By stage."""
