"""Which workers live. Each holds a lease in the database; one that lost it ends itself, and others continue what it left.

No two clocks are ever compared. A worker renews its lease every few seconds, and counts from the moment before it last did so.
Others count from the moment when they first saw that renewal, which is later. So it has ended before anybody takes its work over,
whatever happens to the clocks. A worker whose process is seen to be gone on the same machine is not waited for.
"""

import logging
import os
import socket
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from sqlalchemy.exc import DBAPIError

import gripwright
from gripwright.settings import Settings
from gripwright.store.columns import new_id, utc_now
from gripwright.store.engines import Database
from gripwright.store.workers import WorkerRegister

log = logging.getLogger(__name__)

LOST = 75  # exit code of a worker that was taken over: try again later
_BEATS_A_LEASE = 6


@dataclass(frozen=True, slots=True)
class ProcessName:
    """A process as those can recognise it who see the same process numbers: of the same boot, in the same PID namespace."""

    place: str
    pid: int
    started: str  # by the kernel's clock: numbers are used again

    @classmethod
    def own(cls) -> "ProcessName":
        """This process."""
        return cls(_place(), os.getpid(), _started(os.getpid()) or "")

    @classmethod
    def parse(cls, text: str) -> "ProcessName":
        """The name that was spelt so."""
        place, pid, started = text.split(" ")
        return cls(place, int(pid), started)

    def __str__(self) -> str:
        return f"{self.place} {self.pid} {self.started}"

    def is_surely_gone(self) -> bool:
        """Whether it would be seen here, and is not; never on systems that do not tell."""
        return self.place != "" and self.place == _place() and _started(self.pid) != self.started


class Lease:
    """This worker's place among the workers. `on_loss` is called in a thread of its own; it must end the process at once."""

    def __init__(self, register: WorkerRegister, lease_s: float, on_loss: Callable[[], object]) -> None:
        self.id = new_id(utc_now())
        self.steps = 0
        self._register, self._lease_s, self._on_loss = register, lease_s, on_loss
        self._ends_s = 0.0
        self._lost = self._stopped = False
        self._stop = threading.Event()

    def start(self) -> None:
        """Enter the register, before anything is begun in this worker's name."""
        self._ends_s = time.monotonic() + self._lease_s
        process = ProcessName.own()
        self._register.enter(
            id=self.id, host=socket.gethostname(), process=str(process), pid=process.pid, version=gripwright.__version__
        )
        for target in (self._keep, self._watch):  # a connection that hangs must not keep the watch
            threading.Thread(target=target, name=f"lease{target.__name__}", daemon=True).start()

    def stop(self) -> None:
        """Leave the register: others continue what this worker has begun."""
        self._stop.set()
        self._register.remove(self.id)

    def lose(self) -> None:
        """Note that this worker was struck off the register."""
        self._lost = True

    def _keep(self) -> None:
        while not self._stop.wait(self._lease_s / _BEATS_A_LEASE):
            begun_s = time.monotonic()
            try:
                if self._register.beat(self.id, self.steps):
                    self._ends_s = begun_s + self._lease_s
                elif not self._stop.is_set():
                    self.lose()
                    return
            except DBAPIError as error:
                log.warning("the lease of this worker was not renewed: %s", error.orig)

    def _watch(self) -> None:
        while not self._stop.wait(min(1.0, self._lease_s / 10.0)):
            if self._lost or time.monotonic() > self._ends_s:
                reason = "another one took its work over" if self._lost else f"the database was silent for {self._lease_s:g} s"
                log.error("this worker ends: %s", reason)
                self._on_loss()
                return


class Watch:
    """What one worker sees of all."""

    def __init__(self, register: WorkerRegister, lease_s: float) -> None:
        self._register, self._lease_s = register, lease_s
        self._seen: dict[str, tuple[datetime, float]] = {}  # id → its last heartbeat, and when that was first seen

    def living(self) -> set[str]:
        """The ids of those whose lease runs; the others are struck off, and can renew it no more."""
        now_s, living = time.monotonic(), set()
        rows = self._register.all()
        self._seen = {row.id: self._sight(row.id, row.heartbeat_at, now_s) for row in rows}
        for row in rows:
            silent_s = now_s - self._seen[row.id][1]
            is_gone = ProcessName.parse(row.process).is_surely_gone()
            if not is_gone and silent_s <= self._lease_s:
                living.add(row.id)
            elif self._register.remove(row.id, row.heartbeat_at):
                why = "has ended" if is_gone else f"was silent for {silent_s:.0f} s"
                log.warning("the worker %s on %s %s: others continue its work", row.id, row.host, why)
            else:
                living.add(row.id)  # heard of in this very moment, or struck off by another: the next look tells
        return living

    def _sight(self, worker_id: str, heartbeat_at: datetime, now_s: float) -> tuple[datetime, float]:
        before = self._seen.get(worker_id)
        return before if before is not None and before[0] == heartbeat_at else (heartbeat_at, now_s)


def join_workers(settings: Settings) -> tuple[Lease, Watch]:
    """The lease of this process, not yet entered, and its view of all workers."""
    register = WorkerRegister(Database(settings.resolved_database_url))
    return Lease(register, settings.worker_lease_s, end_at_once), Watch(register, settings.worker_lease_s)


def end_at_once() -> None:
    """End this process with everything that it started: what it would do from now on is another's to do."""
    logging.shutdown()
    os._exit(LOST)


def _place() -> str:
    if sys.platform != "linux":
        return ""
    boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return f"{boot}/{os.readlink('/proc/self/ns/pid')}"


def _started(pid: int) -> str | None:
    """When a process was started; None where there is none, or only what is left of it."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return None
    return None if fields[0] in ("Z", "X") else fields[19]
