"""What a plan asks of the registry: which plug-ins, with which parameters."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from gripwright.design.plan import Plan
from gripwright.domain.errors import Fault, InvalidPlan

CHOICES: Mapping[str, str] = MappingProxyType(
    {
        "segmenter": "segmenter",
        "fitters": "fitter",
        "affordance": "affordance",
        "rules": "rule",
        "hands": "hand",
        "planners": "planner",
        "optimizer": "optimizer",
        "holding": "holding",
        "finger": "finger",
        "policies": "policy",
    }
)
"""Field of the plan → kind of plug-in that it chooses."""


def plan_schema() -> dict[str, Any]:
    """JSON Schema of the options of a plan; `x-plugins` names the kind of plug-ins that an option chooses.

    Parameters of plug-ins are options too, as `key.name`: their schemas are those of the plug-ins.
    """
    schema = Plan.model_json_schema()
    del schema["properties"]["params"]
    for field, kind in CHOICES.items():
        schema["properties"][field]["x-plugins"] = kind
    return schema


PAPER: Mapping[str, Any] = MappingProxyType(
    {
        "segmenter": "sdf",
        "fitters": ("cylinder", "box"),
        "affordance": ("marked",),
        "rules": ("three_finger_cylinder", "two_finger_box"),
        "hands": ("centric_3", "parallel_2"),
        "planners": ("axial", "facet_pairs"),
        "optimizer": "set_cover",
        "holding": (),
        "finger": "straight",
        "policies": (),
    }
)
"""The paper's own method: what `plan=paper` uses whatever the defaults are and whatever is installed."""


def effective_plan(plan: Plan) -> Plan:
    """The plan that is run: with `plan=paper` the paper's own plug-ins; choosing others beside it is a fault."""
    if plan.plan != "paper":
        return plan
    faults = tuple(
        Fault(pointer=f"/options/{field}", message=f"plan=paper uses {_listed(_keys(value))} and nothing else")
        for field, value in PAPER.items()
        if field in plan.model_fields_set and getattr(plan, field) != value
    )
    if faults:
        raise InvalidPlan("the paper's plan allows no other plug-ins", faults=faults)
    return plan.model_copy(update=dict(PAPER))


def chosen(plan: Plan) -> Iterator[tuple[str, str, str]]:
    """(pointer, kind, key) of every plug-in that the plan names."""
    for field, kind in CHOICES.items():
        value = getattr(plan, field)
        if kind == "segmenter":
            yield from ((f"/options/{field}", kind, key) for key in plan.segmenters)
        elif isinstance(value, str):
            yield f"/options/{field}", kind, value
        else:
            for index, key in enumerate(value):
                yield f"/options/{field}/{index}", kind, key


def refuse_faults(
    plan: Plan,
    installed: Iterable[tuple[str, str]],
    not_loaded: Iterable[str],
    params_faults: Callable[[str, str, dict[str, Any]], list[tuple[str, str]]],
) -> None:
    """InvalidPlan that names every fault of a plan, given the (kind, key) of what is installed.

    `not_loaded` are distributions of which nothing is; `params_faults(kind, key, params)` gives the faults of parameters as
    (name, message).
    """
    known = sorted(set(installed))
    faults = plan_faults(plan, known, sorted(set(not_loaded)), params_faults)
    if faults:
        missing = any((kind, key) not in known for _, kind, key in chosen(plan))
        what = "the plan cannot be run with what is installed" if missing else "the options have faults"
        raise InvalidPlan(what, faults=tuple(faults))


def plan_faults(
    plan: Plan,
    known: Sequence[tuple[str, str]],
    not_loaded: Sequence[str],
    params_faults: Callable[[str, str, dict[str, Any]], list[tuple[str, str]]],
) -> list[Fault]:
    """Every fault of a plan; the arguments are those of `refuse_faults`."""
    also = f"; not loaded: {_listed(not_loaded)}, `gripwright plugins` and GET /plugins say why" if not_loaded else ""
    faults = []
    named = set()
    for pointer, kind, key in chosen(plan):
        if (kind, key) in named:
            faults.append(Fault(pointer=pointer, message=f"the {kind} {key!r} is named twice"))
        named.add((kind, key))
        if (kind, key) not in known:
            existing = _listed([other for other_kind, other in known if other_kind == kind])
            faults.append(Fault(pointer=pointer, message=f"there is no {kind} {key!r}; installed: {existing}{also}"))
    for key, params in plan.params.items():
        kinds = [kind for kind, known_key in known if known_key == key]
        if not kinds:
            existing = _listed(sorted({other for _, other in known}))
            faults.append(
                Fault(pointer=f"/options/{key}", message=f"there is no option or plug-in {key!r}; plug-ins: {existing}{also}")
            )
        found = [fault for kind in kinds for fault in params_faults(kind, key, params)]
        for name, message in dict.fromkeys(found):
            faults.append(Fault(pointer=f"/options/{key}.{name}" if name else f"/options/{key}", message=message))
    return faults


def _keys(value: str | tuple[str, ...]) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else value


def _listed(keys: Iterable[str]) -> str:
    return ", ".join(keys) or "none"
