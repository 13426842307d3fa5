"""The server process that children are forked from: it imports everything heavy, once, and every plug-in."""

import contextlib
import multiprocessing
import os
import signal
from multiprocessing import forkserver
from typing import Any

_PRELOADED = "gripwright.jobs.preload"
# Children share the cores among themselves; threads of the linear algebra inside each would only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
FORKED = multiprocessing.get_context("forkserver")
"""Makes processes that are forked from the server."""
FORKED.set_forkserver_preload([_PRELOADED])


def import_first(module: str) -> None:
    """Have the server import a module before everything heavy; it must not run yet."""
    FORKED.set_forkserver_preload([module, _PRELOADED])


def preload() -> None:
    """Start the server, and return: it imports while this process does other things."""
    forkserver.ensure_running()


def end_server() -> None:
    """End a server that does not get ready; the next child gets a new one."""
    server: Any = forkserver._forkserver
    if server._forkserver_pid is not None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(server._forkserver_pid, signal.SIGKILL)


def let_go_of_server() -> None:
    """Close the server's lifeline, of which a child has an end: it would keep the server, and so itself, beyond the worker."""
    server: Any = forkserver._forkserver
    lifeline, server._forkserver_alive_fd = server._forkserver_alive_fd, None
    if lifeline is not None:
        os.close(lifeline)
