"""The assembly sequence as a whole: names and order. Works on raw JSON, so that it finds its faults beside those of types."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from gripwright.domain.errors import Fault


def entries(value: Any, key: str) -> list[Any]:
    """The list under `key`; empty where the value is no object or holds no list there."""
    found = value.get(key) if isinstance(value, dict) else None
    return found if isinstance(found, list) else []


def string_of(value: Any, key: str) -> str | None:
    """The string under `key`, if there is one."""
    found = value.get(key) if isinstance(value, dict) else None
    return found if isinstance(found, str) else None


def duplicate_faults(items: Sequence[Any], key: str) -> list[Fault]:
    """A fault for each id that an earlier entry has already."""
    seen: set[str] = set()
    faults = []
    for k, item in enumerate(items):
        name = string_of(item, "id")
        if name is None:
            continue
        if name in seen:
            faults.append(Fault(f"/{key}/{k}/id", f"the id {name!r} is given twice"))
        seen.add(name)
    return faults


@dataclass(frozen=True, slots=True)
class _Step:
    """What an operation says by name."""

    pointer: str
    id: str
    active: tuple[str, ...]
    passive: tuple[str, ...]
    grasp: str | None


def sequence_faults(operations: Sequence[Any], component_ids: Collection[str]) -> list[Fault]:
    """Faults of names and order, with pointers from the document's root."""
    steps = [_step(k, operation) for k, operation in enumerate(operations)]
    faults = duplicate_faults(operations, "operations")
    for step in steps:
        faults += _name_faults(step, component_ids)
    return faults + _order_faults(steps, component_ids)


def _step(k: int, operation: Any) -> _Step:
    active, passive = (
        tuple(name if isinstance(name, str) else "" for name in entries(operation, key)) for key in ("active", "passive")
    )
    id_ = string_of(operation, "id") or f"number {k + 1}"
    return _Step(f"/operations/{k}", id_, active, passive, string_of(operation, "grasp"))


def _name_faults(step: _Step, component_ids: Collection[str]) -> list[Fault]:
    faults = []
    count = Counter(step.active + step.passive)
    for role, names in (("active", step.active), ("passive", step.passive)):
        for k, name in enumerate(names):
            at = f"{step.pointer}/{role}/{k}"
            if name and name not in component_ids:
                faults.append(Fault(at, f"unknown component {name!r}"))
            elif name and count[name] > 1 and (role == "passive" or name in names[:k]):
                faults.append(Fault(at, f"component {name!r} is named twice in one operation"))
    if step.grasp is not None and step.grasp not in step.active:
        faults.append(Fault(f"{step.pointer}/grasp", f"component {step.grasp!r} is not one of the active ones"))
    return faults


def _order_faults(steps: Sequence[_Step], component_ids: Collection[str]) -> list[Fault]:
    """What stands in its place when, and what hangs together: an operation joins its active to its passive subassembly."""
    first_mover = {name: step.id for step in reversed(steps) for name in step.active}
    placed = {name: "" for name in component_ids if name not in first_mover}  # → the operation that placed it last
    subassembly = {name: {name} for name in component_ids}
    faults = []
    for step in steps:
        for k, name in enumerate(step.passive):
            if name in first_mover and name not in placed and name not in step.active and name in subassembly:
                message = f"component {name!r} is not in its place yet: operation {first_mover[name]!r} moves it first"
                faults.append(Fault(f"{step.pointer}/passive/{k}", message))
        for k, name in enumerate(step.active):
            left_behind = subassembly.get(name, set()) - set(step.active)
            if name in placed and (left_behind or not step.passive):
                message = f"component {name!r} is moved twice: operation {placed[name]!r} placed it already"
                if left_behind:
                    message += f", joined with {', '.join(map(repr, sorted(left_behind)))}, which would be left behind"
                faults.append(Fault(f"{step.pointer}/active/{k}", message))
        joined = set().union(*(subassembly.get(name, set()) for name in step.active + step.passive))
        subassembly.update(dict.fromkeys(joined, joined))
        placed.update(dict.fromkeys(step.active, step.id))
    return faults
