"""What is wrong with the parameters of a plug-in, in the same words on the command line and over HTTP."""

from collections.abc import Mapping
from math import inf
from typing import Any

Fault = tuple[str, str]
"""Name of the parameter, and what is wrong with it."""


def schema_faults(schema: Mapping[str, Any], params: Mapping[str, Any]) -> list[Fault]:
    """Every fault of parameters against their JSON Schema."""
    unreal = [(name, f"{value} is not a number") for name, value in params.items() if value != value or value in (inf, -inf)]
    errors = sorted(_validator(schema).iter_errors(params), key=lambda error: list(map(str, error.absolute_path)))
    return unreal + [fault for error in errors for fault in _faults(error, params, schema)]


def _validator(schema: Mapping[str, Any]) -> Any:
    # not at the top: every child that builds plug-ins would import it
    from jsonschema import Draft202012Validator
    from jsonschema.validators import extend

    # as plug-ins read them: 20.0 is no integer
    integers = Draft202012Validator.TYPE_CHECKER.redefine("integer", lambda _, value: type(value) is int)
    return extend(Draft202012Validator, type_checker=integers)(schema)  # type: ignore[no-untyped-call]


def _faults(error: Any, params: Mapping[str, Any], schema: Mapping[str, Any]) -> list[Fault]:
    path = list(error.absolute_path)
    if error.validator == "additionalProperties" and not path:
        known = sorted(schema.get("properties", {}))
        return [(name, f"there is no such parameter; there {_are(known)}") for name in sorted(set(params) - set(known))]
    return [("/".join(str(part) for part in path), str(error.message))]


def _are(names: list[str]) -> str:
    return "are none" if not names else f"is {names[0]}" if len(names) == 1 else f"are {', '.join(names)}"
