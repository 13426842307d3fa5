"""The stages of a design: what each depends on. Which follows which is in `pipeline`, what they compute in `steps`.

Whoever asks only whether a result is stored needs this module and none of the calculation.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gripwright.design.plan import Plan

if TYPE_CHECKING:
    from gripwright.design.toolbox import Toolbox
    from gripwright.plugin_api import RunContext

StepFunction = Callable[[Mapping[str, Any], Plan, "Toolbox", "RunContext"], Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """A step: where its function is, and what besides its inputs its result depends on (plug-ins by kind, fields of the plan)."""

    name: str
    at: str  # "module:attribute" of a mapping from stages' names to their functions
    uses: tuple[str, ...] = ()
    plan_fields: tuple[str, ...] = ()
    version: int = 1
    remembers: bool = False  # whether it is given a `Memory` for parts of its result, as the input "memory"

    @property
    def function(self) -> StepFunction:
        """What computes it; the calculation is imported when this is first asked for."""
        module, _, attribute = self.at.partition(":")
        functions: Mapping[str, StepFunction] = getattr(importlib.import_module(module), attribute)
        return functions[self.name]


_AT = "gripwright.design.steps:FUNCTIONS"
_GRASPING = ("min_contact", "margin", "release_clearance", "contact_tolerance", "seed")
STAGES: Mapping[str, Stage] = {
    stage.name: stage
    for stage in (
        Stage(name="policies", at=_AT, uses=("policy",)),
        Stage(name="owned", at=_AT, uses=("hand",), plan_fields=("owned",)),
        Stage(name="prepare", at=_AT, version=2),
        Stage(name="segment", at=_AT, uses=("segmenter",), plan_fields=("seed",), version=5),
        Stage(name="fit", at=_AT, uses=("fitter",), plan_fields=("seed",), version=6),
        Stage(name="keep", at=_AT),
        Stage(name="grips", at=_AT, uses=("affordance", "rule", "policy"), plan_fields=("plan", "seed"), version=3),
        Stage(
            name="constraints",
            at=_AT,
            uses=("hand", "planner", "holding"),
            plan_fields=("plan", "finest_rotation", "finest_step", "pad", *_GRASPING),
            version=11,
            remembers=True,
        ),
        Stage(
            name="select",
            at=_AT,
            uses=("optimizer", "hand", "holding"),
            plan_fields=("plan", "release_clearance", "finger_length_step", "safety_factor", "seed"),
            version=7,
        ),
        Stage(name="tips", at=_AT, uses=("finger", "hand"), plan_fields=("safety_factor", "pad", *_GRASPING)),
        Stage(
            name="fingers", at=_AT, uses=("finger", "hand", "holding"), plan_fields=("safety_factor", "pad", "seed"), version=5
        ),
        Stage(name="verify", at=_AT, uses=("hand", "holding"), plan_fields=_GRASPING, version=5, remembers=True),
        Stage(name="result", at=_AT, uses=("segmenter", "optimizer"), plan_fields=tuple(Plan.model_fields), version=12),
    )
}
