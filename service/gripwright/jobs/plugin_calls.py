"""Which plug-in a child process calls at the moment, and what a call may use.

It is told to the parent in memory that outlives the child: however that ends, the plug-in that ran is known, also where it was
killed from outside and could say nothing itself.
"""

import functools
import inspect
import resource
import struct
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.context import BaseContext
from typing import Any

from gripwright.domain.errors import GripwrightError
from gripwright.plugin_api import Params
from gripwright.registry.discovery import InstalledPlugin

_SINCE = struct.Struct("d")  # s, monotonic; 0: no plug-in is called
_NAME_BYTES = 248
_BYTES = _SINCE.size + _NAME_BYTES


class CallNote:
    """The memory that parent and child share."""

    def __init__(self, context: BaseContext) -> None:
        self._shared = context.RawArray("B", _BYTES)

    def __getstate__(self) -> Any:
        return self._shared

    def __setstate__(self, shared: Any) -> None:
        self._shared = shared

    @property
    def view(self) -> memoryview:
        """Its bytes: since when, and behind it the plug-in's name."""
        return memoryview(self._shared).cast("B")

    def read(self) -> tuple[str, float] | None:
        """The plug-in that is called, and since when (s, monotonic); None: none, or it is just being written."""
        view = self.view
        before, name, after = bytes(view[: _SINCE.size]), bytes(view[_SINCE.size :]), bytes(view[: _SINCE.size])
        (since_s,) = _SINCE.unpack(before)
        if before != after or not since_s:
            return None
        return name.rstrip(b"\0").decode(errors="replace"), since_s


class PluginCalls:
    """The calls of plug-ins in this process: each is noted, and has a limit on the memory that it takes."""

    def __init__(self, note: CallNote, memory_mb: int | None) -> None:
        self._view, self._memory_mb = note.view, memory_mb
        self._depth = 0

    @property
    def running(self) -> str | None:
        """The plug-in that is called, or in whose call an exception was raised that nobody caught."""
        since_s, name = _SINCE.unpack_from(self._view)[0], bytes(self._view[_SINCE.size :])
        return name.rstrip(b"\0").decode() if since_s else None

    def make(self, installed: InstalledPlugin, params: Params) -> Any:
        """The plug-in built with its parameters; each call of its methods is noted."""
        label = f"{installed.name} ({installed.distribution} {installed.version})".encode()[:_NAME_BYTES].ljust(
            _NAME_BYTES, b"\0"
        )
        cls: type = installed.plugin
        methods = {
            name: self._noted(method, label)
            for name, method in inspect.getmembers_static(cls, inspect.isfunction)
            if not name.startswith("_")
        }
        noted = type(cls)(cls.__name__, (cls,), {"__module__": cls.__module__, "__qualname__": cls.__qualname__, **methods})
        with self._call(label):
            return noted(params)

    def _noted(self, method: Callable[..., Any], label: bytes) -> Callable[..., Any]:
        @functools.wraps(method)
        def call(*arguments: Any, **named: Any) -> Any:
            with self._call(label):
                return method(*arguments, **named)

        return call

    @contextmanager
    def _call(self, label: bytes) -> Iterator[None]:
        """Note a call while it lasts; the note stays where a defect ends it, so that it names whose that is."""
        before = bytes(self._view)
        self._write(_SINCE.pack(time.monotonic()) + label)
        limits = self._tighten() if self._memory_mb is not None and not self._depth else None
        self._depth += 1
        try:
            yield
        except GripwrightError:
            self._write(before)
            raise
        finally:
            self._depth -= 1
            if limits is not None:
                resource.setrlimit(resource.RLIMIT_AS, limits)
        self._write(before)

    def _write(self, content: bytes) -> None:
        self._view[: _SINCE.size] = bytes(_SINCE.size)  # whoever reads meanwhile reads nothing
        self._view[_SINCE.size :] = content[_SINCE.size :]
        self._view[: _SINCE.size] = content[: _SINCE.size]

    def _tighten(self) -> tuple[int, int] | None:
        """Let this process take only so much more memory; the limits as they were."""
        if sys.platform != "linux":
            return None
        assert self._memory_mb is not None
        limits = resource.getrlimit(resource.RLIMIT_AS)
        with open("/proc/self/statm", "rb", buffering=0) as statm:
            taken = int(statm.read(64).split()[0]) * resource.getpagesize()
        allowed = taken + self._memory_mb * 2**20
        if limits[0] == resource.RLIM_INFINITY or allowed < limits[0]:
            resource.setrlimit(resource.RLIMIT_AS, (allowed, limits[1]))
        return limits
