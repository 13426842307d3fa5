"""Stage results as bytes and back: JSON with typed nodes, arrays as base64, deflated. Nothing is ever executed by reading one."""

import base64
import dataclasses
import importlib
import json
import math
import zlib
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

RecordTypes = Mapping[str, type]


def type_name(cls: type) -> str:
    """How a dataclass is named in a record."""
    return f"{cls.__module__}:{cls.__qualname__}"


def record_types(classes: Iterable[type]) -> RecordTypes:
    """The dataclasses that `loads` may build."""
    return MappingProxyType({type_name(cls): cls for cls in classes})


class OwnTypes(dict[str, type]):
    """Every dataclass of the domain and of the design by its name in records; a module is imported when a record names it."""

    def __missing__(self, name: str) -> type:
        module, _, qualified = name.partition(":")
        if not module.startswith(("gripwright.domain.", "gripwright.design.")):
            raise KeyError(name)
        try:
            cls = getattr(importlib.import_module(module), qualified)
        except (ImportError, AttributeError):
            raise KeyError(name) from None
        if not isinstance(cls, type) or not dataclasses.is_dataclass(cls) or cls.__module__ != module:
            raise KeyError(name)
        self[name] = cls
        return cls


def dumps(value: Any) -> bytes:
    """A value of dataclasses, arrays, mappings, sequences and scalars as bytes; the same value gives the same bytes."""
    return zlib.compress(json.dumps(_encode(value), separators=(",", ":")).encode(), level=1)


def loads(data: bytes, types: RecordTypes) -> Any:
    """The value again; ValueError for a dataclass that is not among `types`."""
    return _decode(json.loads(zlib.decompress(data)), types)


def _encode(value: Any) -> Any:
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else {"$float": repr(value)}
    if isinstance(value, np.ndarray):
        contiguous = np.ascontiguousarray(value)
        return {"$array": [contiguous.dtype.str, list(value.shape), base64.b64encode(contiguous.tobytes()).decode()]}
    if isinstance(value, np.generic):
        return _encode(value.item())
    if isinstance(value, bytes):
        return {"$bytes": base64.b64encode(value).decode()}
    if isinstance(value, tuple | list):
        return {"$" + type(value).__name__: [_encode(item) for item in value]}
    if isinstance(value, Mapping):
        return {"$dict": [[_encode(key), _encode(item)] for key, item in value.items()]}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {field.name: _encode(getattr(value, field.name)) for field in dataclasses.fields(value) if field.init}
        return {"$type": type_name(type(value)), "fields": fields}
    raise TypeError(f"a {type(value).__name__} cannot be stored in a record")


def _decode(node: Any, types: RecordTypes) -> Any:
    if not isinstance(node, dict):
        return node
    (tag, body), *_ = node.items()
    match tag:
        case "$float":
            return float(body)
        case "$array":
            dtype, shape, data = body
            return np.frombuffer(base64.b64decode(data), dtype=np.dtype(dtype)).reshape(shape)
        case "$bytes":
            return base64.b64decode(body)
        case "$tuple":
            return tuple(_decode(item, types) for item in body)
        case "$list":
            return [_decode(item, types) for item in body]
        case "$dict":
            return {_decode(key, types): _decode(item, types) for key, item in body}
        case "$type":
            try:
                cls = types[body]
            except KeyError:
                raise ValueError(f"a record names the type {body}, which is not known here") from None
            return cls(**{name: _decode(item, types) for name, item in node["fields"].items()})
    raise ValueError(f"a record has the unknown tag {tag}")
