"""Strict JSON and pointers to what is wrong in it."""

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from pydantic import BaseModel, ValidationError

from gripwright.domain.errors import Fault, InvalidInput, LimitExceeded

_MESSAGES = {
    "missing": "required, but absent",
    "extra_forbidden": "unknown field",
    "model_type": "must be an object",
    "tuple_type": "must be a list",
    "too_short": "at least {min_length} needed, {actual_length} given",
    "too_long": "at most {max_length} allowed",
}
MAX_FAULTS = 1000  # of one answer
_TEXT_MAX = 1000  # characters of one message
_MAX_NAMES = 10_000  # of one object: each that is unknown is a fault


class _NotJson(ValueError):
    """Something that Python's parser lets pass and JSON does not."""


def pointer(*parts: str | int) -> str:
    """The JSON pointer (RFC 6901) of these steps."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in parts)


def parse_json(document: bytes, name: str, max_bytes: int) -> Any:
    """The value of a JSON document; NaN, Infinity and repeated names are no JSON. InvalidInput says where parsing stopped."""
    if len(document) > max_bytes:
        raise LimitExceeded(f"{name} has {len(document)} bytes, at most {max_bytes}", file=name)
    try:
        value = json.loads(document.decode("utf-8-sig"), parse_constant=_refuse_constant, object_pairs_hook=_unique_names)
        json.dumps(value, ensure_ascii=False).encode()  # an escaped half of a surrogate pair is no text
        return value
    except json.JSONDecodeError as error:
        message = f"not valid JSON: {error.msg} at line {error.lineno}, column {error.colno}"
    except UnicodeDecodeError as error:
        message = f"not valid JSON: byte {error.start} is not UTF-8"
    except RecursionError:
        message = f"not valid JSON: nested more than {sys.getrecursionlimit()} levels deep or so"
    except ValueError as error:  # _NotJson, half surrogates, numbers of more digits than Python converts
        message = f"not valid JSON: {error}"
    refuse(f"{name} is {message}", [Fault(pointer=name, message=message)])


def _refuse_constant(constant: str) -> NoReturn:
    raise _NotJson(f"{constant} is no number")


def _unique_names(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    if len(pairs) > _MAX_NAMES:
        raise _NotJson(f"an object of {len(pairs)} names, at most {_MAX_NAMES} are read")
    value: dict[str, Any] = {}
    for name, member in pairs:
        if name in value:
            raise _NotJson(f"the name {name[:100]!r} is given twice in one object")
        value[name] = member
    return value


def refuse(detail: str, faults: Sequence[Fault]) -> NoReturn:
    """Raise InvalidInput with these faults, or of very many the first; none says more than a few lines."""
    if len(faults) > MAX_FAULTS:
        detail = f"{detail}: more than {MAX_FAULTS} faults, of which these are the first"
    shown = tuple(Fault(fault.pointer[:_TEXT_MAX], fault.message[:_TEXT_MAX]) for fault in faults[:MAX_FAULTS])
    raise InvalidInput(detail[:_TEXT_MAX], faults=shown)


def checked_entries(value: Any, lists: Mapping[str, tuple[type[BaseModel], int]]) -> tuple[Any, list[Fault]]:
    """The value with its lists' entries checked one by one, and what is wrong with them.

    `lists` names those of the value, with the model of an entry and the most that are allowed. A validator of the whole
    would collect a fault for everything in it, of which a hostile document has millions; here it ends when enough is known.
    """
    if not isinstance(value, dict):
        return value, []
    checked, faults = dict(value), list[Fault]()
    for key, (model, most) in lists.items():
        items = value.get(key)
        if not isinstance(items, list):
            continue
        if len(items) > most:
            refuse(f"{key} is too long", [Fault(pointer(key), f"at most {most} allowed, {len(items)} given")])
        entries = []
        for k, item in enumerate(items):
            try:
                entries.append(model.model_validate(item))
            except ValidationError as error:
                faults += faults_of(error, key, k)
            if len(faults) > MAX_FAULTS:
                return checked, faults
        checked[key] = entries
    return checked, faults


def faults_of(error: ValidationError, *prefix: str | int) -> list[Fault]:
    """The faults of a document that is not what its model says; `prefix` leads to the part that was validated."""
    faults = []
    for entry in error.errors(include_url=False, include_input=False):
        context = entry.get("ctx", {})
        location = entry["loc"][:-1] if entry["loc"][-1:] == ("[key]",) else entry["loc"]  # a name at fault is its member's fault
        steps = (*prefix, *location, *context.get("at", ()))  # a validator of a whole object names the member that it blames
        message = _MESSAGES[entry["type"]].format_map(context) if entry["type"] in _MESSAGES else entry["msg"]
        faults.append(Fault(pointer=pointer(*steps), message=message))
    return faults
