"""One piece of work in a child process that can be killed: a crash, a hang or a leak ends the child and nothing else.

Children are forked from a server process that has imported everything heavy, so they start in milliseconds. A child has a
session of its own (its own children die with it), a memory limit, and dies with its parent.
"""

import contextlib
import ctypes
import errno
import json
import logging
import multiprocessing
import os
import resource
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from gripwright.domain.errors import Cancelled, Fault, GripwrightError
from gripwright.jobs.child_log import LogOfParent, log_for_child
from gripwright.jobs.fork_server import FORKED, end_server, let_go_of_server
from gripwright.jobs.plugin_calls import CallNote, PluginCalls

Progress = Callable[[float, str], None]
"""Takes a fraction (0..1) and a message."""

Work = Callable[[Any, Progress, PluginCalls], Any]
"""A function of a module, given a JSON value, where to report progress and what to call plug-ins by; returns a JSON value."""

log = logging.getLogger(__name__)

_POLL_S = 0.1
_END_S = 2.0
_PR_SET_PDEATHSIG = 1
_FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM)  # of the kernel that needs memory, or of whoever looks after the machine
_SHORTAGES = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EMFILE, errno.ENFILE, errno.EAGAIN, errno.ENOMEM)
_FRESH = multiprocessing.get_context("spawn")


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a child may use."""

    memory_mb: int = 4096  # address space on top of what the preloaded modules take
    timeout_s: float = 900.0
    plugin_memory_mb: int | None = None  # of one call of a plug-in, on top of what is taken when it begins
    plugin_timeout_s: float | None = None  # of one call of a plug-in


class ChildFailure(Exception):
    """The child brought no result: how it ended, and within a call of which plug-in."""

    plugin: str | None = None  # "kind/key (distribution version)"


class ChildBroke(ChildFailure):
    """The child crashed, or took more memory or time than it may: it would again."""


class ChildTimeout(ChildBroke):
    """The child was ended at its deadline."""


class ChildLost(ChildFailure):
    """The child was killed, could not be started, or found a disk full: another one may be luckier."""


class ChildNotStarted(ChildLost):
    """The server that children are forked from ended, or did not get ready: it imports every plug-in."""


class Refused(GripwrightError):
    """A GripwrightError that was raised in the child, with the code that it had there."""

    def __init__(self, code: str, detail: str, faults: tuple[Fault, ...], **context: object) -> None:
        super().__init__(detail, faults=faults, **context)
        self.code = code  # type: ignore[misc]  # a ClassVar elsewhere: here each instance repeats another error's


def is_shortage(error: OSError) -> bool:
    """Whether the machine, not the work, is the reason: a full disk, too many open files."""
    return error.errno in _SHORTAGES


def run_in_child(
    work: Work,
    argument: Any,
    *,
    limits: Limits,
    on_progress: Progress = lambda fraction, message: None,
    cancelled: Callable[[], bool] = lambda: False,
    fresh: bool = False,
) -> Any:
    """The JSON value that `work(argument, progress, calls)` returns. Raises Cancelled, Refused, or ChildFailure.

    `fresh`: in a new interpreter instead of a fork of the preloaded one, for work that imports little.
    """
    context = _FRESH if fresh else FORKED
    receiver, sender = context.Pipe(duplex=False)
    deadline = time.monotonic() + limits.timeout_s
    try:
        note = CallNote(context)
        process = context.Process(target=_main, args=(work, argument, limits, sender, note), daemon=True)
        if fresh:
            process.start()  # in this thread: the child dies with the thread that started it
        else:
            _start(process, deadline, cancelled)
    except (EOFError, OSError) as error:
        raise ChildNotStarted(f"could not be started: {error}") from error
    finally:
        sender.close()
    try:
        return _receive(process, receiver, deadline, limits, note, on_progress, cancelled)
    except ChildFailure as failure:
        called = note.read()
        failure.plugin = None if called is None else called[0]
        raise
    finally:
        _kill(process)
        receiver.close()


def _start(process: BaseProcess, deadline: float, cancelled: Callable[[], bool]) -> None:
    """Start a child of the prepared server, which may still be importing: nobody waits for that in vain, or for ever."""
    failures: list[Exception] = []
    is_unwanted = threading.Event()

    def start() -> None:
        try:
            process.start()
        except (EOFError, OSError) as error:
            failures.append(error)
        if is_unwanted.is_set():
            _kill(process)

    thread = threading.Thread(target=start, name="start of a child", daemon=True)
    thread.start()
    thread.join(_POLL_S)
    while thread.is_alive():
        stop: Exception | None = Cancelled("the caller asked to stop") if cancelled() else None
        if stop is None and time.monotonic() > deadline:
            stop = ChildNotStarted("could not be started in time")
            end_server()
        if stop is not None:
            is_unwanted.set()
            _kill(process)
            raise stop
        thread.join(_POLL_S)
    for failure in failures:
        raise failure


def _receive(
    process: BaseProcess,
    receiver: Connection,
    deadline: float,
    limits: Limits,
    note: CallNote,
    on_progress: Progress,
    cancelled: Callable[[], bool],
) -> Any:
    while True:
        if receiver.poll(_POLL_S):
            try:
                kind, body = json.loads(receiver.recv_bytes())
            except (EOFError, OSError):
                raise _ending(process, limits) from None
            match kind:
                case "progress":
                    on_progress(*body)
                case "result":
                    process.join(timeout=_END_S)  # it gives back what it registered
                    return body
                case "refused":
                    faults = tuple(Fault(*fault) for fault in body.pop("faults"))
                    raise Refused(body["code"], body["detail"], faults, **body["context"])
                case "log":
                    log_for_child(*body)
                case "defect":
                    raise ChildFailure(body)
                case "broke":
                    raise ChildBroke(body)
                case "lost":
                    raise ChildLost(body)
        if cancelled():
            raise Cancelled("the caller asked to stop")
        if time.monotonic() > deadline:
            raise ChildTimeout(f"took more than {limits.timeout_s:g} s")
        if limits.plugin_timeout_s is not None:
            _end_a_long_call(note, limits.plugin_timeout_s)


def _end_a_long_call(note: CallNote, timeout_s: float) -> None:
    called = note.read()
    if called is not None and time.monotonic() - called[1] > timeout_s:
        raise ChildTimeout(f"took more than the {timeout_s:g} s that one call of a plug-in may take")


def _ending(process: BaseProcess, limits: Limits) -> ChildFailure:
    """How a process without a result ended."""
    process.join(timeout=5.0)
    code = process.exitcode
    if code is None or code >= 0:
        return ChildBroke(f"ended with code {code} and no result")
    name = signal.Signals(-code).name
    if -code in _FROM_OUTSIDE:
        return ChildLost(
            f"was ended with {name}, most likely since the machine is out of memory (its limit is {limits.memory_mb} MB)"
        )
    return ChildBroke(f"crashed with {name}")


def _kill(process: BaseProcess) -> None:
    """End the child and everything it started."""
    if process.pid is None:
        return
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    if process.is_alive():  # before its first line the child has no group of its own
        process.kill()
    process.join(timeout=5.0)


def _main(work: Work, argument: Any, limits: Limits, sender: Connection, note: CallNote) -> None:
    """The child's life."""
    _confine(limits)
    calls = PluginCalls(note, limits.plugin_memory_mb)
    lock = threading.Lock()
    let_go_of_server()

    def send(kind: str, body: Any) -> None:
        with lock:
            sender.send_bytes(json.dumps([kind, body]).encode())

    logging.getLogger().handlers = [LogOfParent(send)]
    try:
        send("result", work(argument, lambda fraction, message: send("progress", [fraction, message]), calls))
    except MemoryError:
        send("broke", _shortage_of_memory(limits, in_plugin=calls.running is not None))
    except GripwrightError as error:
        faults = [[fault.pointer, fault.message] for fault in error.faults]
        context = {name: value if isinstance(value, int | float | str) else repr(value) for name, value in error.context.items()}
        send("refused", {"code": error.code, "detail": error.detail, "faults": faults, "context": context})
    except OSError as error:
        log.exception("work in a child process failed")
        send("lost" if is_shortage(error) else "defect", f"raised {type(error).__name__}: {error}")
    except Exception as error:
        log.exception("work in a child process failed")
        send("defect", f"raised {type(error).__name__}: {error}")


def _shortage_of_memory(limits: Limits, *, in_plugin: bool) -> str:
    own = limits.plugin_memory_mb
    if in_plugin and own is not None and own < limits.memory_mb:
        return f"needs more than the {own} MB of memory that one call of a plug-in may take"
    return f"needs more than {limits.memory_mb} MB of memory"


def _confine(limits: Limits) -> None:
    """Own session, death with the parent, limited memory; nothing but the pipe to talk to."""
    os.setsid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        with open("/proc/self/statm", "rb") as statm:
            preloaded = int(statm.read().split()[0]) * resource.getpagesize()
        limit = preloaded + limits.memory_mb * 2**20
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.dup2(2, 1)  # native libraries print; standard output belongs to the parent
