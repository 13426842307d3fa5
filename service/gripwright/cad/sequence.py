"""The assembly sequence as a whole: names and order. Works on raw JSON, so that it finds its faults beside those of types."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from gripwright.cad.document import MAX_FAULTS
from gripwright.domain.errors import Fault

_NAMES_MAX = 5000  # of one operation; that there are no more is checked with its types
_SHOWN = 200  # characters of a name
_LISTED = 10  # components that one message names


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
            faults.append(Fault(f"/{key}/{k}/id", f"the id {name[:_SHOWN]!r} is given twice"))
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
    known = frozenset(component_ids)
    steps = [_step(k, operation) for k, operation in enumerate(operations)]
    faults = duplicate_faults(operations, "operations")
    for step in steps:
        faults += _name_faults(step, known)
        if len(faults) > MAX_FAULTS:
            return faults
    return faults + _order_faults(steps, known)


def _step(k: int, operation: Any) -> _Step:
    active, passive = (
        tuple(name if isinstance(name, str) else "" for name in entries(operation, key)[:_NAMES_MAX])
        for key in ("active", "passive")
    )
    id_ = string_of(operation, "id") or f"number {k + 1}"
    return _Step(f"/operations/{k}", id_, active, passive, string_of(operation, "grasp"))


def _name_faults(step: _Step, component_ids: Collection[str]) -> list[Fault]:
    faults = []
    active, seen = set(step.active), set[str]()
    for role, names in (("active", step.active), ("passive", step.passive)):
        for k, name in enumerate(names):
            at = f"{step.pointer}/{role}/{k}"
            if name and name not in component_ids:
                faults.append(Fault(at, f"unknown component {name[:_SHOWN]!r}"))
            elif name and name in seen:
                faults.append(Fault(at, f"component {name[:_SHOWN]!r} is named twice in one operation"))
            seen.add(name)
    if step.grasp is not None and step.grasp not in active:
        faults.append(Fault(f"{step.pointer}/grasp", f"component {step.grasp!r} is not one of the active ones"))
    return faults


def _order_faults(steps: Sequence[_Step], component_ids: Collection[str]) -> list[Fault]:
    """What stands in its place when, and what hangs together: an operation joins its active to its passive subassembly."""
    first_mover = {name: step.id for step in reversed(steps) for name in step.active}
    placed = {name: "" for name in component_ids if name not in first_mover}  # → the operation that placed it last
    subassembly = {name: {name} for name in component_ids}
    faults: list[Fault] = []
    for step in steps:
        if len(faults) > MAX_FAULTS:
            break
        active = set(step.active)
        for k, name in enumerate(step.passive):
            if name in first_mover and name not in placed and name not in active and name in subassembly:
                message = f"component {name[:_SHOWN]!r} is not in its place yet: operation {first_mover[name]!r} moves it first"
                faults.append(Fault(f"{step.pointer}/passive/{k}", message))
        left_behind: dict[int, str] = {}  # of each subassembly, said once a step: it may be large
        for k, name in enumerate(step.active):
            if name not in placed:
                continue
            whole = subassembly.get(name, set())
            if id(whole) not in left_behind:
                left_behind[id(whole)] = _listed(whole - active)
            joined = left_behind[id(whole)]
            if joined or not step.passive:
                message = f"component {name[:_SHOWN]!r} is moved twice: operation {placed[name]!r} placed it already"
                if joined:
                    message += f", joined with {joined}, which would be left behind"
                faults.append(Fault(f"{step.pointer}/active/{k}", message))
        _join(subassembly, step.active + step.passive)
        placed.update(dict.fromkeys(step.active, step.id))
    return faults


def _listed(names: Collection[str]) -> str:
    shown = ", ".join(map(repr, sorted(names)[:_LISTED]))
    return shown if len(names) <= _LISTED else f"{shown} and {len(names) - _LISTED} more"


def _join(subassembly: dict[str, set[str]], names: Sequence[str]) -> None:
    """Make one of the subassemblies of these components, the small ones joined to the largest: long sequences stay cheap."""
    found = {id(whole): whole for name in names if (whole := subassembly.get(name)) is not None}
    if len(found) < 2:
        return
    largest = max(found.values(), key=len)
    for whole in found.values():
        if whole is not largest:
            largest |= whole
            subassembly.update(dict.fromkeys(whole, largest))
