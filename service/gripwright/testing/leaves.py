"""A value taken apart, to compare it with itself at another time and to name the place of a difference."""

import dataclasses
import pickle
from collections.abc import Iterator, Mapping
from hashlib import sha256
from typing import Any

import numpy as np
from pydantic import BaseModel


def leaves(value: Any) -> dict[str, bytes]:
    """Place → digest of every array and plain value inside; dataclasses, models, sequences and mappings are entered."""
    return {place or "the value": sha256(data).digest() for place, data in _walk("", value)}


def first_difference(before: dict[str, bytes], after: dict[str, bytes]) -> str | None:
    """The first place whose value is not the same, None where all are."""
    return next((place for place in {**before, **after} if before.get(place) != after.get(place)), None)


def _walk(place: str, value: Any) -> Iterator[tuple[str, bytes]]:
    """Every leaf with its content. Containers yield their length, so that an empty one differs from none."""
    if isinstance(value, np.ndarray):
        yield place, f"{value.dtype} {value.shape}".encode() + np.ascontiguousarray(value).tobytes()
    elif isinstance(value, BaseModel):
        yield place, value.model_dump_json().encode()
    elif dataclasses.is_dataclass(value):
        yield f"{place} (class)", type(value).__qualname__.encode()
        for field in dataclasses.fields(value):
            yield from _walk(f"{place}.{field.name}".lstrip("."), getattr(value, field.name))
    elif isinstance(value, Mapping):
        yield f"{place} (keys)", repr(list(value)).encode()
        for key, item in value.items():
            yield from _walk(f"{place}[{key!r}]", item)
    elif isinstance(value, list | tuple):
        yield f"{place} (length)", str(len(value)).encode()
        for k, item in enumerate(value):
            yield from _walk(f"{place}[{k}]", item)
    elif isinstance(value, set | frozenset):
        yield place, repr(sorted(map(repr, value))).encode()
    elif isinstance(value, str | bytes | bool | int | float | None):
        yield place, f"{type(value).__name__} {value!r}".encode()
    else:
        yield place, pickle.dumps(value)
