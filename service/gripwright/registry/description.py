"""What is installed as plain JSON, so that the API process can show plug-ins and check options without importing any."""

import json
import subprocess
import sys
from collections.abc import Collection, Mapping
from typing import Any, TypedDict

from gripwright.design.plan import Plan, plan_of
from gripwright.domain.errors import Fault, InvalidPlan, PluginFailure
from gripwright.registry.discovery import InstalledPlugin, Registry
from gripwright.registry.parameters import schema_faults
from gripwright.registry.plans import effective_plan, refuse_faults

LOADING = "loading "
"""Begins the line of a distribution that is loaded next."""


class PluginDescription(TypedDict):
    """One installed plug-in."""

    kind: str
    key: str
    version: str
    distribution: str
    summary: str
    options: dict[str, Any]  # JSON Schema of its parameters
    warnings: list[str]  # what it uses of the contract that is deprecated


class FailureDescription(TypedDict):
    """One manifest that did not load."""

    distribution: str
    plugin: str
    reason: str


class RegistryDescription(TypedDict):
    """Everything installed."""

    plugins: list[PluginDescription]
    failures: list[FailureDescription]


class RegistryUnreadable(PluginFailure):
    """The child process that lists the plug-ins ended badly; a plug-in crashes at import, or strict loading failed.

    `distribution` in the context is the one that was loaded.
    """


def describe(registry: Registry) -> RegistryDescription:
    """The registry as JSON values."""
    return RegistryDescription(
        plugins=[_describe(plugin) for plugin in registry.plugins],
        failures=[
            FailureDescription(distribution=failure.distribution, plugin=failure.plugin, reason=failure.reason)
            for failure in registry.failures
        ],
    )


def describe_in_child(
    *, allow: Collection[str] | None = None, strict: bool = False, timeout_s: float = 120.0
) -> RegistryDescription:
    """`describe` of what is installed, by a process of its own: no plug-in is imported here, and none can crash this process."""
    request = json.dumps({"allow": None if allow is None else sorted(allow), "strict": strict})
    command = [sys.executable, "-m", "gripwright.registry.describe", request]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)
    except subprocess.TimeoutExpired as expired:
        printed = expired.stdout.decode(errors="replace") if isinstance(expired.stdout, bytes) else expired.stdout or ""
        raise _unreadable(f"took more than {timeout_s:.0f} s", printed) from None
    if run.returncode != 0:
        last = run.stderr.strip().splitlines()[-1:] or ["no message"]
        raise _unreadable(f"ended with code {run.returncode}", run.stdout, f": {last[0]}")
    description: RegistryDescription = json.loads(run.stdout.splitlines()[-1])
    return description


def _unreadable(what: str, printed: str, last: str = "") -> RegistryUnreadable:
    """What happened, and while which distribution was loaded."""
    lines = [line.removeprefix(LOADING) for line in printed.splitlines() if line.startswith(LOADING)]
    loading = f" while {lines[-1]} was loaded" if lines else ""
    return RegistryUnreadable(f"listing the plug-ins {what}{loading}{last}", distribution=lines[-1] if lines else None)


def check_options(options: Mapping[str, Any], description: RegistryDescription) -> Plan:
    """The plan of options as given, checked against what is installed. InvalidPlan names every fault at its place."""
    plan = effective_plan(plan_of(options))
    schemas = {(plugin["kind"], plugin["key"]): plugin["options"] for plugin in description["plugins"]}
    not_loaded = (failure["distribution"] for failure in description["failures"])
    try:
        refuse_faults(plan, schemas, not_loaded, lambda kind, key, params: schema_faults(schemas[kind, key], params))
    except InvalidPlan as refused:
        placed = tuple(Fault(pointer=_as_given(fault.pointer, options), message=fault.message) for fault in refused.faults)
        raise InvalidPlan(refused.detail, faults=placed) from None
    return plan


def _as_given(pointer: str, options: Mapping[str, Any]) -> str:
    """The place of a parameter in the options: `sdf.rays`, or `rays` in `sdf` where they are given so."""
    key, dot, name = pointer.removeprefix("/options/").partition(".")
    is_nested = dot and f"{key}.{name}" not in options and isinstance(options.get(key), Mapping)
    return f"/options/{key}/{name}" if is_nested else pointer


def _describe(plugin: InstalledPlugin) -> PluginDescription:
    documentation = (plugin.plugin.__doc__ or "").strip()
    return PluginDescription(
        kind=plugin.kind,
        key=plugin.key,
        version=plugin.version,
        distribution=plugin.distribution,
        summary=documentation.splitlines()[0] if documentation else "",
        options=plugin.plugin.params_model.model_json_schema(),
        warnings=list(plugin.warnings),
    )
