"""From a plan to a toolbox: the chosen plug-ins with the plan's parameters, or every fault of the plan together."""

import json
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from typing import Any

from pydantic import ValidationError

from gripwright.design.plan import Plan
from gripwright.design.toolbox import PluginVersion, Toolbox, record_classes
from gripwright.plugin_api import GraspPlanner, Params
from gripwright.registry.discovery import InstalledPlugin, Registry
from gripwright.registry.parameters import schema_faults
from gripwright.registry.plans import chosen, effective_plan, refuse_faults

Make = Callable[[InstalledPlugin, Params], Any]


def _made(installed: InstalledPlugin, params: Params) -> Any:
    return installed.plugin(params)


def build_toolbox(plan: Plan, registry: Registry, make: Make = _made) -> Toolbox:
    """The plug-ins of the plan, built by `make`. InvalidPlan names every fault at its place in the options."""
    plan = effective_plan(plan)
    refuse_faults(
        plan,
        ((plugin.kind, plugin.key) for plugin in registry.plugins),
        (failure.distribution for failure in registry.failures),
        partial(_params_faults, registry),
    )
    versions: dict[str, PluginVersion] = {}
    built: dict[str, dict[str, Any]] = defaultdict(dict)  # kind → key → instance
    for _, kind, key in chosen(plan):
        installed = registry.find(kind, key)
        assert installed is not None  # refuse_faults would have said so
        params = parse_params(installed, plan.params.get(key, {}))
        built[kind][key] = make(installed, params)
        versions[installed.name] = PluginVersion(
            distribution=installed.distribution, version=installed.version, params=params.model_dump(mode="json")
        )
    planners: dict[str, list[GraspPlanner]] = defaultdict(list)
    for planner in built["planner"].values():
        for gripper_type in sorted(planner.gripper_types):
            planners[gripper_type].append(planner)
    return Toolbox(
        segmenters=built["segmenter"],
        fitters=built["fitter"],
        affordance=tuple(built["affordance"].values()),
        rules=tuple(built["rule"].values()),
        hands={hand.gripper_type: hand for hand in reversed(built["hand"].values())},  # the first named wins
        planners={gripper_type: tuple(found) for gripper_type, found in planners.items()},
        optimizer=built["optimizer"][plan.optimizer],
        holding=_by_type(built["holding"]),
        fingers=_by_type(built["finger"]),
        policies=tuple(built["policy"].values()),
        versions=versions,
        record_classes=(*record_classes(), *(cls for plugin in registry.plugins for cls in plugin.record_classes)),
    )


def _by_type(plugins: dict[str, Any]) -> dict[str, Any]:
    """The plug-in that serves each gripper type: the first named."""
    return {gripper_type: plugin for plugin in reversed(plugins.values()) for gripper_type in plugin.gripper_types}


def parse_params(installed: InstalledPlugin, params: dict[str, Any]) -> Params:
    """The parameters as the plug-in's model; JSON values are taken as they are, "20" is no number."""
    model: type[Params] = installed.plugin.params_model
    return model.model_validate_json(json.dumps(params), strict=True)


def _params_faults(registry: Registry, kind: str, key: str, params: dict[str, Any]) -> list[tuple[str, str]]:
    """(name, message) of each fault, by the plug-in's own model; worded by its JSON Schema where that sees one."""
    installed = registry.find(kind, key)
    assert installed is not None
    try:
        parse_params(installed, params)
    except ValidationError as error:
        by_model = [("/".join(str(part) for part in fault["loc"]), fault["msg"]) for fault in error.errors()]
        return schema_faults(installed.plugin.params_model.model_json_schema(), params) or by_model
    return []
