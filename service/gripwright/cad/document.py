"""Strict JSON and pointers to what is wrong in it."""

import json
from collections.abc import Sequence
from typing import Any, NoReturn

from pydantic import ValidationError

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
        message = "not valid JSON: nested too deeply"
    except ValueError as error:  # _NotJson, half surrogates, numbers of more digits than Python converts
        message = f"not valid JSON: {error}"
    refuse(f"{name} is {message}", [Fault(pointer=name, message=message)])


def _refuse_constant(constant: str) -> NoReturn:
    raise _NotJson(f"{constant} is no number")


def _unique_names(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    value: dict[str, Any] = {}
    for name, member in pairs:
        if name in value:
            raise _NotJson(f"the name {name!r} is given twice in one object")
        value[name] = member
    return value


def refuse(detail: str, faults: Sequence[Fault]) -> NoReturn:
    """Raise InvalidInput with these faults, or of very many the first."""
    if len(faults) > MAX_FAULTS:
        detail = f"{detail}: {len(faults)} faults, of which these are the first {MAX_FAULTS}"
    raise InvalidInput(detail, faults=tuple(faults[:MAX_FAULTS]))


def faults_of(error: ValidationError, *prefix: str | int) -> list[Fault]:
    """The faults of a document that is not what its model says; `prefix` leads to the part that was validated."""
    faults = []
    for entry in error.errors(include_url=False):
        context = entry.get("ctx", {})
        location = entry["loc"][:-1] if entry["loc"][-1:] == ("[key]",) else entry["loc"]  # a name at fault is its member's fault
        steps = (*prefix, *location, *context.get("at", ()))  # a validator of a whole object names the member that it blames
        message = _MESSAGES[entry["type"]].format_map(context) if entry["type"] in _MESSAGES else entry["msg"]
        faults.append(Fault(pointer=pointer(*steps), message=message))
    return faults
