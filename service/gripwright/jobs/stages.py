"""The stages of a design as the service runs them: those of the calculation, and the design folder made of its result."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from gripwright.design.plan import Plan
from gripwright.design.steps import STAGES as DESIGN_STAGES
from gripwright.design.steps import Stage
from gripwright.design.toolbox import Toolbox
from gripwright.plugin_api import RunContext
from gripwright.report.folder import design_folder


def export(inputs: Mapping[str, Any], plan: Plan, toolbox: Toolbox, ctx: RunContext) -> dict[str, bytes]:
    """The files of the design folder by their paths."""
    del plan, ctx
    return design_folder(inputs["result"], toolbox.hands)


STAGES: Mapping[str, Stage] = MappingProxyType({**DESIGN_STAGES, "export": Stage(name="export", function=export, uses=("hand",))})
