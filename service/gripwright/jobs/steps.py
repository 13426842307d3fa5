"""One step of a design: what identifies it, and how it is run in a child process unless its result is stored already."""

import hashlib
import importlib
import json
import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from gripwright.design.memory import Memory
from gripwright.design.plan import Plan
from gripwright.design.records import OwnTypes, RecordTypes, dumps, loads, record_types
from gripwright.design.runner import Ref
from gripwright.design.toolbox import PluginVersion
from gripwright.domain.errors import GripwrightError, PluginFailure
from gripwright.jobs.child import Limits, Progress, is_shortage, run_in_child
from gripwright.jobs.engine import StepFailure
from gripwright.jobs.guarded import guarded
from gripwright.jobs.installed import installed_registry
from gripwright.jobs.plugin_calls import PluginCalls
from gripwright.plugin_api import RunContext
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import Registry
from gripwright.registry.plans import effective_plan
from gripwright.settings import Settings
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.steps import StepStore
from gripwright.store.storage import open_artifacts, open_steps

if TYPE_CHECKING:
    from gripwright.design.stage_table import Stage

log = logging.getLogger(__name__)

STAGES_AT, ANALYSIS_STAGES_AT = "gripwright.jobs.stages:STAGES", "gripwright.jobs.stages:ANALYSIS_STAGES"
SEQUENCE_STAGES_AT = "gripwright.jobs.stages:SEQUENCE_STAGES"
_CONTEXT_FIELDS = {"seed": "seed", "min_contact": "min_contact_mm", "margin": "margin_mm"}  # of the plan → of RunContext

Versions = Mapping[str, PluginVersion]
"""The plug-ins of a plan by "kind/key", in the order of the plan."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Workshop:
    """Where steps run and keep their results."""

    data_dir: Path
    storage_url: str | None = None  # none: in the data folder
    plugins_allow: tuple[str, ...] | None = None
    limits: Limits = Limits()  # noqa: RUF009 - frozen
    stages_at: str = STAGES_AT  # "module:attribute" of the stages

    @classmethod
    def of(cls, settings: Settings, stages_at: str = STAGES_AT) -> "Workshop":
        """The workshop that the settings describe."""
        return cls(
            data_dir=settings.data_dir,
            storage_url=settings.storage_url,
            plugins_allow=settings.plugins_allow,
            limits=Limits(
                memory_mb=settings.step_memory_mb,
                timeout_s=settings.step_timeout_s,
                plugin_memory_mb=settings.plugin_memory_mb,
                plugin_timeout_s=settings.plugin_timeout_s,
            ),
            stages_at=stages_at,
        )

    @property
    def storage(self) -> str:
        """Where results and files are kept, as a URL."""
        return self.storage_url or self.data_dir.as_uri()

    @property
    def steps(self) -> StepStore:
        """Results of steps."""
        return open_steps(self.storage)

    @property
    def artifacts(self) -> ArtifactStore:
        """Files by their content."""
        return open_artifacts(self.storage)

    def put(self, value: Any) -> Ref:
        """Store an input of the calculation by its content."""
        data = dumps(value)
        key = hashlib.sha256(data).hexdigest()
        if not self.steps.has(key):
            self.steps.save(key, data)
        return key

    def get(self, ref: Ref) -> Any:
        """A stored value of the domain's own types; those of plug-ins are not loaded in this process."""
        return _stored(self.steps, ref, OwnTypes())


class StepCall(TypedDict):
    """One call of a stage, as JSON."""

    stage: str
    inputs: dict[str, Any]  # JSON, results of other steps as {"ref": key}
    plan: dict[str, Any]
    versions: dict[str, PluginVersion]  # of the plug-ins that the stage uses
    key: Ref


class Computation(TypedDict):
    """Where and when a step was computed."""

    pid: int
    start_ns: int
    end_ns: int


def load_stages(at: str) -> "Mapping[str, Stage]":
    """The stages at "module:attribute"."""
    module, _, attribute = at.partition(":")
    stages: Mapping[str, Stage] = getattr(importlib.import_module(module), attribute)
    return stages


def resolve_plan(
    workshop: Workshop, plan: Plan, *, cancelled: Callable[[], bool] = lambda: False
) -> tuple[Plan, dict[str, PluginVersion]]:
    """The plan that is run and the exact plug-ins and parameters it means; InvalidPlan names every fault."""
    plan = effective_plan(plan)
    argument = {"plan": plan.model_dump(mode="json"), "allow": workshop.plugins_allow}
    return plan, guarded(
        "plan",
        workshop.plugins_allow,
        lambda: run_in_child(_versions, argument, limits=workshop.limits, cancelled=cancelled),
    )


def step_call(stage: "Stage", inputs: Mapping[str, Any], plan: Plan, versions: Versions) -> StepCall:
    """The call with its key: the hash of the stage and its version, the inputs, and all of the plan that the stage may see."""
    used = {name: version for name, version in versions.items() if _uses(stage, name, inputs)}
    key = _hash([*_scope(stage, plan, used), dict(inputs)])
    return StepCall(stage=stage.name, inputs=dict(inputs), plan=plan.model_dump(mode="json"), versions=used, key=key)


def _scope(stage: "Stage", plan: Plan, used: Versions) -> list[Any]:
    """All that a step's result depends on besides its inputs, as JSON."""
    fields = plan.model_dump(mode="json", include=set(stage.plan_fields))
    return [stage.name, stage.version, fields, list(used.items())]


def _hash(identity: list[Any]) -> str:
    return hashlib.sha256(json.dumps(identity, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _uses(stage: "Stage", plugin: str, inputs: Mapping[str, Any]) -> bool:
    """Whether a stage uses the plug-in "kind/key": of a kind that it uses, and the one that the call names if it names one."""
    kind, _, key = plugin.partition("/")
    return kind in stage.uses and inputs.get(kind, key) == key


def run_step(
    workshop: Workshop,
    call: StepCall,
    *,
    on_progress: Progress = lambda fraction, message: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Computation | None:
    """Compute and store the result of a call, in a child; None where it is stored already and nothing had to be done.

    Raises Cancelled, any GripwrightError of the stage, StepBroke where the step crashed, hung or took too much memory, and
    PassingFailure where its process was lost.
    """
    if workshop.steps.has(call["key"]):
        return None
    argument = {
        "call": call,
        "allow": workshop.plugins_allow,
        "stages_at": workshop.stages_at,
        "storage": workshop.storage,
    }
    computation: Computation = guarded(
        call["stage"],
        workshop.plugins_allow,
        lambda: run_in_child(_compute, argument, limits=workshop.limits, on_progress=on_progress, cancelled=cancelled),
    )
    return computation


def _stored(store: StepStore, ref: Ref, types: RecordTypes) -> Any:
    data = store.find(ref)
    if data is None:
        raise StepFailure(f"the stored result {ref} is gone: retry the design")
    return loads(data, types)


# What follows runs in a child.


def _versions(argument: dict[str, Any], progress: Progress, calls: PluginCalls) -> dict[str, PluginVersion]:
    del progress
    plan, registry = Plan(**argument["plan"]), _registry(argument["allow"])
    with _blamed(calls, "plan"):
        return dict(build_toolbox(plan, registry, calls.make).versions)


def _compute(argument: dict[str, Any], progress: Progress, calls: PluginCalls) -> Computation:
    """Run the stage of a call and store its result."""
    start_ns = time.time_ns()
    call: StepCall = argument["call"]
    registry, store = _registry(argument["allow"]), open_steps(argument["storage"])
    plan = Plan(**call["plan"])
    with _blamed(calls, call["stage"]):
        toolbox = build_toolbox(plan, registry, calls.make)
    if any(toolbox.versions.get(name) != version for name, version in call["versions"].items()):
        raise StepFailure("plug-ins were changed while the design ran: retry it", stage=call["stage"])
    stage = load_stages(argument["stages_at"])[call["stage"]]
    types = record_types(toolbox.record_classes)
    inputs = _with_values(call["inputs"], cache(lambda ref: _stored(store, ref, types)))
    if stage.remembers:
        inputs["memory"] = Memory(_hash(_scope(stage, plan, call["versions"])), _Parts(store, types))
    seen = {field: getattr(plan, name) for name, field in _CONTEXT_FIELDS.items() if name in stage.plan_fields}
    with _blamed(calls, stage.name):
        value = stage.function(inputs, _declared(plan, stage), toolbox, RunContext(progress=progress, **seen))
    store.save(call["key"], dumps(value))
    return Computation(pid=os.getpid(), start_ns=start_ns, end_ns=time.time_ns())


class _Parts:
    """Parts of results, kept as results are."""

    def __init__(self, store: StepStore, types: RecordTypes) -> None:
        self._store, self._types = store, types

    def find(self, key: str) -> Any | None:
        data = self._store.find(key)
        return None if data is None else loads(data, self._types)

    def save(self, key: str, part: Any) -> None:
        self._store.save(key, dumps(part))


def _registry(allow: Sequence[str] | None) -> Registry:
    return installed_registry(None if allow is None else tuple(allow))


def _declared(plan: Plan, stage: "Stage") -> Plan:
    """The plan with the fields that the stage declares and no others: what is not in a step's key must not reach the step."""
    seen = plan.model_copy()
    for name in set(Plan.model_fields) - set(stage.plan_fields):
        del seen.__dict__[name]
    return seen


def _with_values(node: Any, value_of: Callable[[Ref], Any]) -> Any:
    """The inputs of a call, stored results in place of their refs."""
    if isinstance(node, Mapping):
        if set(node) == {"ref"}:
            return value_of(node["ref"])
        return {name: _with_values(item, value_of) for name, item in node.items()}
    if isinstance(node, list | tuple):
        return [_with_values(item, value_of) for item in node]
    return node


@contextmanager
def _blamed(calls: PluginCalls, stage: str) -> Iterator[None]:
    """What a plug-in raises is its failure; what says of itself what is wrong, and a shortage, are not."""
    try:
        yield
    except (GripwrightError, MemoryError):
        raise
    except Exception as error:
        if calls.running is None or (isinstance(error, OSError) and is_shortage(error)):
            raise
        plugin, _, origin = calls.running.partition(" ")
        log.exception("the plug-in %s failed in the stage %s", calls.running, stage)
        raise PluginFailure(f"{plugin} raised {type(error).__name__}: {error} {origin}", stage=stage, plugin=plugin) from error
