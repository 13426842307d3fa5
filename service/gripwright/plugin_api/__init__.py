"""THE public contract for plug-in authors. Semantic versioning: `API_VERSION`. Everything a plug-in may import is here,
in `gripwright.domain` and in `gripwright.geometry`."""

from gripwright.plugin_api.context import RunContext
from gripwright.plugin_api.contracts import (
    AffordanceDetector,
    FaceHand,
    FingerDesigner,
    GraspPlanner,
    GripperOptimizer,
    GripperRule,
    HandModel,
    HoldingModel,
    HousePolicy,
    Plugin,
    PrimitiveFitter,
    Segmenter,
    TaperedFingerDesigner,
    TipShaper,
    VTipDesigner,
)
from gripwright.plugin_api.grips import grips_of
from gripwright.plugin_api.manifest import API_VERSION, Manifest, PluginEntry
from gripwright.plugin_api.params import Params

__all__ = [
    "API_VERSION",
    "AffordanceDetector",
    "FaceHand",
    "FingerDesigner",
    "GraspPlanner",
    "GripperOptimizer",
    "GripperRule",
    "HandModel",
    "HoldingModel",
    "HousePolicy",
    "Manifest",
    "Params",
    "Plugin",
    "PluginEntry",
    "PrimitiveFitter",
    "RunContext",
    "Segmenter",
    "TaperedFingerDesigner",
    "TipShaper",
    "VTipDesigner",
    "grips_of",
]
