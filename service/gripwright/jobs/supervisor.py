"""Keeps N worker processes alive beside the API process; one that ends is started again, more slowly where it ends at once.

A worker that is there and does nothing, not even beat, is killed: its successor continues what it had.
"""

import contextlib
import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence

from gripwright.settings import Settings

log = logging.getLogger(__name__)

LIFELINE = "GRIPWRIGHT_LIFELINE"
"""Environment variable of an embedded worker: its standard input closes when its supervisor dies, and it ends then."""

HEARTBEAT = "GRIPWRIGHT_HEARTBEAT"
"""Environment variable of an embedded worker: the number of the pipe that it writes to as long as its threads run."""

_LOOK_S = 0.2
_BEAT_S = 1.0
_HUNG_S = 20.0  # longer than a machine that swaps keeps a healthy worker from its beats
_PAUSE_MAX_S = 10.0
_HEALTHY_S = 10.0  # a worker that lived so long is started again without a pause
_END_S = 5.0

WORKER = (sys.executable, "-m", "gripwright.cli", "worker")


class Supervisor:
    """`start` returns at once; `stop` ends the workers and waits for them."""

    def __init__(self, settings: Settings, command: Sequence[str] = WORKER, hung_s: float = _HUNG_S) -> None:
        self._environment = {**os.environ, "GRIPWRIGHT_DATA": str(settings.data_dir), LIFELINE: "1"}
        self._command = list(command)
        self._count, self._hung_s = settings.workers, hung_s
        self._stop = threading.Event()
        self._threads: list[threading.Thread] = []
        self._workers: dict[int, subprocess.Popen[bytes]] = {}  # by the thread that keeps them alive

    def start(self) -> None:
        """Start the workers."""
        for number in range(self._count):
            thread = threading.Thread(target=self._keep_alive, name=f"supervisor-{number}", daemon=True)
            thread.start()
            self._threads.append(thread)

    def stop(self) -> None:
        """End the workers. Designs that run are continued at the next start."""
        self._stop.set()
        for thread in self._threads:
            thread.join()

    def count_alive(self) -> int:
        """How many workers run now."""
        return sum(worker.poll() is None for worker in list(self._workers.values()))

    def _keep_alive(self) -> None:
        pause_s = _LOOK_S
        while not self._stop.is_set():
            started_s = time.monotonic()
            worker = self._run_worker()
            if self._stop.is_set():
                _end(worker)
                return
            pause_s = _LOOK_S if time.monotonic() - started_s > _HEALTHY_S else min(2.0 * pause_s, _PAUSE_MAX_S)
            log.warning("a worker ended with code %s; the next starts in %.1f s", worker.returncode, pause_s)
            self._stop.wait(pause_s)

    def _run_worker(self) -> "subprocess.Popen[bytes]":
        """Start a worker; return when it has ended, or when this supervisor is to stop."""
        beats, beat = os.pipe()
        os.set_blocking(beats, False)
        environment = {**self._environment, HEARTBEAT: str(beat)}
        worker = subprocess.Popen(self._command, stdin=subprocess.PIPE, env=environment, start_new_session=True, pass_fds=(beat,))
        os.close(beat)
        self._workers[threading.get_ident()] = worker
        heard_s = time.monotonic()
        while worker.poll() is None and not self._stop.wait(_LOOK_S):
            with contextlib.suppress(BlockingIOError):
                if os.read(beats, 4096):
                    heard_s = time.monotonic()
            if time.monotonic() - heard_s > self._hung_s:
                log.error("a worker has not been heard of for %.0f s and is killed", self._hung_s)
                os.killpg(worker.pid, signal.SIGKILL)
                worker.wait()
        os.close(beats)
        return worker


def beat() -> None:
    """Let the supervisor of this process know that it lives, from now on; nothing to do where there is none."""
    pipe = os.environ.pop(HEARTBEAT, None)
    if pipe is None:
        return

    def run() -> None:
        with contextlib.suppress(BrokenPipeError):
            while os.write(int(pipe), b"."):
                time.sleep(_BEAT_S)

    threading.Thread(target=run, name="heartbeat", daemon=True).start()


def _end(worker: "subprocess.Popen[bytes]") -> None:
    worker.terminate()
    try:
        worker.wait(_END_S)
    except subprocess.TimeoutExpired:
        worker.kill()
        worker.wait()
