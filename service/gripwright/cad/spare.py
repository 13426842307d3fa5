"""A process to read CAD files that is there before they come: to start one takes longer than to read a small file."""

import contextlib
import json
import os
import subprocess
import sys
import threading
from dataclasses import asdict, replace

from gripwright.cad.limits import Limits

_END_S = 10.0


class SpareReader:
    """Keeps one process ahead for whoever reads next under these limits. It serves one reader alone; then another is started.

    The thread that starts them lives as long as this does: the kernel kills a child with the *thread* that started it.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._change = threading.Condition()
        self._child: subprocess.Popen[bytes] | None = None
        self._ended = False
        self._keeper = threading.Thread(target=self._keep, name="spare reader", daemon=True)

    @property
    def waiting(self) -> int | None:
        """The process id of the one that waits; None while there is none."""
        with self._change:
            return None if self._child is None else self._child.pid

    def start(self) -> None:
        """Begin to keep one."""
        self._keeper.start()

    def take(self, limits: Limits) -> "subprocess.Popen[bytes] | None":
        """The process, the caller's from now on; None where none is ready, or `limits` allow something else than it does."""
        if replace(limits, seconds=0.0) != replace(self._limits, seconds=0.0):  # who reads watches over the time for all files
            return None
        with self._change:
            child, self._child = self._child, None
            self._change.notify()
        if child is not None and child.poll() is not None:
            end_reader(child)
            return None
        return child

    def stop(self) -> None:
        """End the one that waits, and start no other."""
        with self._change:
            self._ended = True
            child, self._child = self._child, None
            self._change.notify()
        if child is not None:
            end_reader(child)
        if self._keeper.is_alive():
            self._keeper.join(_END_S)

    def _keep(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._ended or self._child is None)
                if self._ended:
                    return
            child = start_reader(self._limits)
            with self._change:
                if not self._ended:
                    self._child = child
                    continue
            end_reader(child)


def start_reader(limits: Limits) -> "subprocess.Popen[bytes]":
    """A process of cad/child.py. It ends with the thread that calls this."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "gripwright.cad.child", json.dumps(asdict(limits))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )


def end_reader(child: "subprocess.Popen[bytes]") -> None:
    """End it, whatever it is at, and close its streams."""
    child.kill()
    child.wait()
    for stream in (child.stdin, child.stdout):
        if stream is not None:
            with contextlib.suppress(BrokenPipeError):  # a request that was never read
                stream.close()
