"""One piece of work in a child process that can be killed: a crash, a hang or a leak ends the child and nothing else.

Children are forked from a server process that has imported everything heavy, so they start in milliseconds. A child has a
session of its own (its own children die with it), a memory limit, and dies with its parent.
"""

import contextlib
import ctypes
import json
import logging
import multiprocessing
import os
import resource
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from gripwright.domain.errors import Cancelled, Fault, GripwrightError

Progress = Callable[[float, str], None]
"""Takes a fraction (0..1) and a message."""

Work = Callable[[Any, Progress], Any]
"""A function of a module, given a JSON value and told where to report progress; returns a JSON value."""

log = logging.getLogger(__name__)

_POLL_S = 0.1
_END_S = 2.0
_PR_SET_PDEATHSIG = 1
# Children share the cores among themselves; threads of the linear algebra inside each would only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
_FORKED = multiprocessing.get_context("forkserver")
_FORKED.set_forkserver_preload(["gripwright.jobs.preload"])
_FRESH = multiprocessing.get_context("spawn")


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a child may use."""

    memory_mb: int = 4096  # address space on top of what the preloaded modules take
    timeout_s: float = 900.0


class ChildFailure(Exception):
    """The child brought no result: how it ended."""


class ChildTimeout(ChildFailure):
    """The child was ended at its deadline."""


class Refused(GripwrightError):
    """A GripwrightError that was raised in the child, with the code that it had there."""

    def __init__(self, code: str, detail: str, faults: tuple[Fault, ...], **context: object) -> None:
        super().__init__(detail, faults=faults, **context)
        self.code = code  # type: ignore[misc]  # a ClassVar elsewhere: here each instance repeats another error's


def preload() -> None:
    """Start the server that children are forked from, and return: it imports while this process does other things."""
    forkserver.ensure_running()


def run_in_child(
    work: Work,
    argument: Any,
    *,
    limits: Limits,
    on_progress: Progress = lambda fraction, message: None,
    cancelled: Callable[[], bool] = lambda: False,
    fresh: bool = False,
) -> Any:
    """The JSON value that `work(argument, progress)` returns. Raises Cancelled, Refused, or ChildFailure.

    `fresh`: in a new interpreter instead of a fork of the preloaded one, for work that imports little.
    """
    context = _FRESH if fresh else _FORKED
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_main, args=(work, argument, limits, sender), daemon=True)
    deadline = time.monotonic() + limits.timeout_s
    try:
        process.start()
    except (EOFError, OSError) as error:
        raise ChildFailure(f"no process could be started: {error}") from error
    sender.close()
    try:
        return _receive(process, receiver, deadline, limits, on_progress, cancelled)
    finally:
        _kill(process)
        receiver.close()


def _receive(
    process: BaseProcess,
    receiver: Connection,
    deadline: float,
    limits: Limits,
    on_progress: Progress,
    cancelled: Callable[[], bool],
) -> Any:
    while True:
        if receiver.poll(_POLL_S):
            try:
                kind, body = json.loads(receiver.recv_bytes())
            except (EOFError, OSError):
                raise ChildFailure(_ending(process, limits)) from None
            match kind:
                case "progress":
                    on_progress(*body)
                case "result":
                    process.join(timeout=_END_S)  # it gives back what it registered
                    return body
                case "refused":
                    faults = tuple(Fault(*fault) for fault in body.pop("faults"))
                    raise Refused(body["code"], body["detail"], faults, **body["context"])
                case "defect":
                    raise ChildFailure(body)
        if cancelled():
            raise Cancelled("the caller asked to stop")
        if time.monotonic() > deadline:
            raise ChildTimeout(f"took more than {limits.timeout_s:g} s")


def _ending(process: BaseProcess, limits: Limits) -> str:
    """How a process without a result ended."""
    process.join(timeout=5.0)
    code = process.exitcode
    if code is not None and code < 0:
        name = signal.Signals(-code).name
        hint = f", most likely out of memory (the limit is {limits.memory_mb} MB)" if -code == signal.SIGKILL else ""
        return f"crashed with {name}{hint}"
    return f"ended with code {code} and no result"


def _kill(process: BaseProcess) -> None:
    """End the child and everything it started."""
    if process.pid is None:
        return
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    if process.is_alive():  # before its first line the child has no group of its own
        process.kill()
    process.join(timeout=5.0)


def _main(work: Work, argument: Any, limits: Limits, sender: Connection) -> None:
    """The child's life."""
    _confine(limits)
    _let_go_of_server()

    def send(kind: str, body: Any) -> None:
        sender.send_bytes(json.dumps([kind, body]).encode())

    try:
        send("result", work(argument, lambda fraction, message: send("progress", [fraction, message])))
    except MemoryError:
        send("defect", f"needs more than {limits.memory_mb} MB of memory")
    except GripwrightError as error:
        faults = [[fault.pointer, fault.message] for fault in error.faults]
        context = {name: value if isinstance(value, int | float | str) else repr(value) for name, value in error.context.items()}
        send("refused", {"code": error.code, "detail": error.detail, "faults": faults, "context": context})
    except Exception as error:
        log.exception("work in a child process failed")
        send("defect", f"raised {type(error).__name__}: {error}")


def _let_go_of_server() -> None:
    """Close the server's lifeline, of which a child has an end: it would keep the server, and so itself, beyond the worker."""
    server: Any = forkserver._forkserver
    lifeline, server._forkserver_alive_fd = server._forkserver_alive_fd, None
    if lifeline is not None:
        os.close(lifeline)


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
