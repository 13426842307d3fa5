"""The stages of a design as the service runs them: those of the calculation, and the design folder made of its result."""

from collections.abc import Mapping
from types import MappingProxyType

from gripwright.design.stage_table import STAGES as DESIGN_STAGES
from gripwright.design.stage_table import Stage

_AT = "gripwright.jobs.stage_functions:FUNCTIONS"

STAGES: Mapping[str, Stage] = MappingProxyType(
    {**DESIGN_STAGES, "export": Stage(name="export", at=_AT, uses=("hand",), version=9, remembers=True)}
)
"""Of a whole design."""

ANALYSIS_STAGES: Mapping[str, Stage] = MappingProxyType(
    {
        **{name: DESIGN_STAGES[name] for name in ("prepare", "segment", "fit", "keep")},
        "describe": Stage(name="describe", at=_AT, version=3),
    }
)
"""Of the analysis of one component."""

SEQUENCE_STAGES: Mapping[str, Stage] = MappingProxyType(
    {"prepare": DESIGN_STAGES["prepare"], "propose": Stage(name="propose", at=_AT, plan_fields=("contact_tolerance",))}
)
"""Of the proposal of an assembly sequence."""
