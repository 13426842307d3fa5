"""Parts of a step's result that need not be computed again when the rest of its inputs has changed.

A part is found by what it was made from, by content. It must depend on that and on nothing else but the step's stage, its version
and plug-ins, and the options that it sees: those are the memory's scope. So a step gives the same bytes, whatever is remembered.
"""

import dataclasses
import hashlib
from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

import numpy as np

from gripwright.design.records import type_name
from gripwright.domain.shape import Mesh

T = TypeVar("T")


class PartStore(Protocol):
    """Where parts are kept."""

    def find(self, key: str) -> Any | None:
        """The part under a key, or None."""
        ...

    def save(self, key: str, part: Any) -> None:
        """Keep a part."""
        ...


class Nowhere:
    """Keeps nothing."""

    def find(self, key: str) -> None:
        """None."""

    def save(self, key: str, part: Any) -> None:
        """Nothing is done."""


class Memory:
    """Parts of one scope."""

    def __init__(self, scope: str = "", store: PartStore | None = None) -> None:
        self._scope, self._store = scope, Nowhere() if store is None else store
        self._meshes: dict[int, tuple[Mesh, bytes]] = {}  # held, so that an id stays that of its mesh

    def part(self, name: str, made_from: Any, make: Callable[[], T]) -> T:
        """What `make` returns, or returned when it was last asked for the same name and `made_from`."""
        key = self.key(name, made_from)
        found: T | None = self.find(key)
        if found is None:
            found = make()
            self.save(key, found)
        return found

    def find(self, key: str) -> Any | None:
        """What is kept under a key, or None."""
        return self._store.find(key)

    def save(self, key: str, part: Any) -> None:
        """Keep a part, in place of what was kept under its key."""
        self._store.save(key, part)

    def key(self, name: str, made_from: Any) -> str:
        """Under which a part is kept: of dataclasses, arrays, mappings, sequences and scalars the same content, the same key."""
        return self._digest([self._scope, name, made_from]).hex()

    def _digest(self, value: Any) -> bytes:
        if isinstance(value, Mesh):
            if id(value) not in self._meshes:
                self._meshes[id(value)] = (value, self._content(value))
            return self._meshes[id(value)][1]
        return self._content(value)

    def _content(self, value: Any) -> bytes:
        if isinstance(value, np.ndarray):
            return _hash(f"array {value.dtype.str} {value.shape}", np.ascontiguousarray(value).tobytes())
        if isinstance(value, bytes):
            return _hash("bytes", value)
        if isinstance(value, Mapping):
            return _hash("mapping", *(self._digest(item) for pair in value.items() for item in pair))
        if isinstance(value, tuple | list):
            return _hash(type(value).__name__, *map(self._digest, value))
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            fields = (getattr(value, field.name) for field in dataclasses.fields(value))
            return _hash(type_name(type(value)), *map(self._digest, fields))
        if value is None or isinstance(value, bool | int | float | str | np.generic):
            return _hash(f"{type(value).__name__} {value!r}")
        raise TypeError(f"nothing can be remembered by a {type(value).__name__}")


def _hash(kind: str, *contents: bytes) -> bytes:
    """Of a node of given kind and its contents, which are digests or, alone, any bytes."""
    state = hashlib.sha256(kind.encode() + b"\0")
    for content in contents:
        state.update(content)
    return state.digest()
