"""Whether a class keeps the plug-in contract, as far as can be seen without running it on a component.

`runtime_checkable` looks at names alone, so a plug-in with the wrong arguments would pass it and fail in a design.
"""

import inspect
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, get_args, get_origin, get_type_hints

from gripwright.plugin_api import contracts
from gripwright.plugin_api.params import Params

PROTOCOLS: Mapping[str, type] = MappingProxyType(
    {
        "segmenter": contracts.Segmenter,
        "fitter": contracts.PrimitiveFitter,
        "affordance": contracts.AffordanceDetector,
        "rule": contracts.GripperRule,
        "hand": contracts.HandModel,
        "planner": contracts.GraspPlanner,
        "holding": contracts.HoldingModel,
        "optimizer": contracts.GripperOptimizer,
        "finger": contracts.FingerDesigner,
        "policy": contracts.HousePolicy,
    }
)


def contract_faults(plugin: Any, kind: str, key: str) -> list[str]:
    """What is wrong with a class that a manifest announces as `kind`/`key`; empty: nothing."""
    if not inspect.isclass(plugin):
        return [f"is a {type(plugin).__name__}, not a class"]
    faults = _attribute_faults(plugin, PROTOCOLS[kind])
    for name, declared in _methods(PROTOCOLS[kind]).items():
        faults += _method_faults(plugin, name, declared)
    own_key = getattr(plugin, "key", None)
    if isinstance(own_key, str) and own_key != key:
        faults.append(f"its key is {own_key!r}, the manifest says {key!r}")
    return faults or _construction_faults(plugin)


def _methods(protocol: type) -> dict[str, Any]:
    return {name: member for name, member in vars(protocol).items() if inspect.isfunction(member) and not name.startswith("_")}


def _attribute_faults(plugin: type, protocol: type) -> list[str]:
    """ClassVars that are absent or hold a value of another type than the contract says."""
    faults = []
    for name, hint in get_type_hints(protocol).items():
        (declared,) = get_args(hint)  # ClassVar[declared]
        if name == "params_model":
            continue  # checked by building it
        expected = get_origin(declared) or declared
        value = getattr(plugin, name, None)
        if not isinstance(value, expected):
            faults.append(f"{name} must be a class variable of type {expected.__name__}, is {value!r}")
        elif expected is frozenset and not all(isinstance(item, str) for item in value):
            faults.append(f"{name} must hold strings, holds {sorted(map(repr, value))}")
    return faults


def _method_faults(plugin: type, name: str, declared: Any) -> list[str]:
    method = inspect.getattr_static(plugin, name, None)
    if not inspect.isfunction(method):
        return [f"has no method {name}{inspect.signature(declared)}"]
    if inspect.iscoroutinefunction(method) or inspect.isgeneratorfunction(method):
        return [f"{name} must be a plain function"]
    expected = list(inspect.signature(declared).parameters.values())
    actual = list(inspect.signature(method).parameters.values())
    same = [p.name for p in actual[1 : len(expected)]] == [p.name for p in expected[1:]] and all(
        p.kind is p.POSITIONAL_OR_KEYWORD for p in actual[: len(expected)]
    )
    optional = all(p.default is not p.empty or p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) for p in actual[len(expected) :])
    if same and optional:
        return []
    wanted, found = (", ".join(p.name for p in parameters) for parameters in (expected, actual))
    return [f"{name} must take ({wanted}), takes ({found})"]


def _construction_faults(plugin: Any) -> list[str]:
    model = getattr(plugin, "params_model", None)
    if not (inspect.isclass(model) and issubclass(model, Params)):
        return [f"params_model must be a subclass of Params, is {model!r}"]
    try:
        plugin(model())
    except Exception as error:  # noqa: BLE001 - a plug-in's own code
        return [f"cannot be built with its default parameters: {type(error).__name__}: {error}"]
    return []
