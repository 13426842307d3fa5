"""The plug-ins of one plan, built with its parameters: what the stages compute with."""

import dataclasses
import importlib
import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TypedDict

import gripwright.design
import gripwright.domain
from gripwright.plugin_api import (
    AffordanceDetector,
    FingerDesigner,
    GraspPlanner,
    GripperOptimizer,
    GripperRule,
    HandModel,
    HoldingModel,
    HousePolicy,
    PrimitiveFitter,
    Segmenter,
)


class PluginVersion(TypedDict):
    """What exactly computed: stored with every result."""

    distribution: str
    version: str
    params: dict[str, object]  # every parameter, defaults included


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Toolbox:
    """The chosen plug-ins of each kind, in the order of the plan where the order matters."""

    segmenters: Mapping[str, Segmenter]  # by key
    fitters: Mapping[str, PrimitiveFitter]  # by key
    affordance: tuple[AffordanceDetector, ...]
    rules: tuple[GripperRule, ...]  # the preferred one first
    hands: Mapping[str, HandModel]  # by gripper type
    planners: Mapping[str, tuple[GraspPlanner, ...]]  # by gripper type
    optimizer: GripperOptimizer
    fingers: Mapping[str, FingerDesigner]  # by gripper type
    policies: tuple[HousePolicy, ...]
    versions: Mapping[str, PluginVersion]  # by "kind/key"
    record_classes: tuple[type, ...]  # dataclasses that a stored result may hold
    holding: Mapping[str, HoldingModel] = field(default_factory=dict)  # by gripper type; types that are not among them close jaws


@cache
def record_classes() -> tuple[type, ...]:
    """Every dataclass of the domain and of the design, for `records.record_types`."""
    modules = [
        importlib.import_module(module.name)
        for package in (gripwright.domain, gripwright.design)
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    ]
    return tuple(
        member
        for module in modules
        for member in vars(module).values()
        if isinstance(member, type) and dataclasses.is_dataclass(member) and member.__module__ == module.__name__
    )
