"""Stage results as bytes and back. Nothing is ever executed by reading one.

A record is JSON with typed nodes, deflated, and behind it the arrays and bytes as they are: they are read far more often than
written, and to deflate them takes longer than many a step. The first records held them within the JSON, as base64.
"""

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
import numpy.typing as npt

from gripwright.domain.shape import IntArray

RecordTypes = Mapping[str, type]

_MARK = b"GWR2"  # at the beginning of a record; the first ones began with their deflated JSON
_ALIGNED = 16  # bytes: compiled functions distinguish arrays that are not aligned


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
    blobs = bytearray()
    text = zlib.compress(json.dumps(_encode(value, blobs), separators=(",", ":")).encode(), level=1)
    head = _MARK + len(text).to_bytes(8, "little") + text
    return head + b"\0" * (-len(head) % _ALIGNED) + bytes(blobs)


def loads(data: bytes, types: RecordTypes) -> Any:
    """The value again; ValueError for a dataclass that is not among `types`."""
    if not data.startswith(_MARK):
        return _decode(json.loads(zlib.decompress(data)), types, b"", 0)
    begin = len(_MARK) + 8
    end = begin + int.from_bytes(data[len(_MARK) : begin], "little")
    return _decode(json.loads(zlib.decompress(data[begin:end])), types, data, end + -end % _ALIGNED)


def _place(blobs: bytearray, content: bytes) -> int:
    """Where the content lies that is added to the blobs."""
    place = len(blobs)
    blobs += content + b"\0" * (-len(content) % _ALIGNED)
    return place


def _narrow(array: IntArray) -> str:
    """The type as which integers are stored: the half of them where they fit."""
    limits = np.iinfo(np.int32)
    fits = array.size and limits.min <= array.min() and array.max() <= limits.max
    return np.dtype(np.int32).str if fits else array.dtype.str


def _encode(value: Any, blobs: bytearray) -> Any:
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else {"$float": repr(value)}
    if isinstance(value, np.ndarray):
        stored = _narrow(value) if value.dtype == np.int64 else value.dtype.str
        place = _place(blobs, value.astype(stored, copy=False).tobytes())
        return {"$array": [value.dtype.str, list(value.shape), place, stored]}
    if isinstance(value, np.generic):
        return _encode(value.item(), blobs)
    if isinstance(value, bytes):
        return {"$bytes": [_place(blobs, value), len(value)]}
    if isinstance(value, tuple | list):
        return {"$" + type(value).__name__: [_encode(item, blobs) for item in value]}
    if isinstance(value, Mapping):
        return {"$dict": [[_encode(key, blobs), _encode(item, blobs)] for key, item in value.items()]}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            field.name: _encode(getattr(value, field.name), blobs)
            for field in dataclasses.fields(value)
            if _is_held(field, value)
        }
        return {"$type": type_name(type(value)), "fields": fields}
    raise TypeError(f"a {type(value).__name__} cannot be stored in a record")


def _is_held(field: "dataclasses.Field[Any]", value: Any) -> bool:
    """Whether a record holds a field of a value (see `domain.later`)."""
    return field.init and not ("later" in field.metadata and getattr(value, field.name) == field.default)


def _decode(node: Any, types: RecordTypes, data: bytes, blobs: int) -> Any:
    if not isinstance(node, dict):
        return node
    (tag, body), *_ = node.items()
    match tag:
        case "$float":
            return float(body)
        case "$array":
            return _array(body, data, blobs)
        case "$bytes":
            return base64.b64decode(body) if isinstance(body, str) else data[blobs + body[0] : blobs + body[0] + body[1]]
        case "$tuple":
            return tuple(_decode(item, types, data, blobs) for item in body)
        case "$list":
            return [_decode(item, types, data, blobs) for item in body]
        case "$dict":
            return {_decode(key, types, data, blobs): _decode(item, types, data, blobs) for key, item in body}
        case "$type":
            try:
                cls = types[body]
            except KeyError:
                raise ValueError(f"a record names the type {body}, which is not known here") from None
            return cls(**{name: _decode(item, types, data, blobs) for name, item in node["fields"].items()})
    raise ValueError(f"a record has the unknown tag {tag}")


def _array(body: list[Any], data: bytes, blobs: int) -> npt.NDArray[Any]:
    """An array that cannot be written to, as all that come out of records."""
    dtype, shape, place, *stored = body
    if isinstance(place, str):
        return np.frombuffer(base64.b64decode(place), dtype=np.dtype(dtype)).reshape(shape)
    found = np.frombuffer(data, dtype=np.dtype(stored[0]), count=math.prod(shape), offset=blobs + place).reshape(shape)
    found = found.astype(dtype, copy=False)
    found.flags.writeable = False
    return found
