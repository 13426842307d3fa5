"""Which classes of a plug-in's answer a stored result may hold: those of the domain, and those that a manifest names."""

import dataclasses
from collections.abc import Collection, Mapping
from typing import Any

_OWN = "gripwright.domain."


def unnamed_class(primitive: Any, named: Collection[type]) -> type | None:
    """The first class of a primitive, its own or that of a value in it, that is neither the domain's nor among those named."""
    cls = type(primitive)
    return cls if _is_missing(cls, named) else _inside(primitive, named)


def _inside(value: Any, named: Collection[type]) -> type | None:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        if _is_missing(type(value), named):
            return type(value)
        parts = [getattr(value, field.name) for field in dataclasses.fields(value)]
    elif isinstance(value, Mapping):
        parts = list(value.values())
    elif isinstance(value, list | tuple):
        parts = list(value)
    else:
        return None
    return next((found for part in parts if (found := _inside(part, named)) is not None), None)


def _is_missing(cls: type, named: Collection[type]) -> bool:
    return cls not in named and not cls.__module__.startswith(_OWN)
