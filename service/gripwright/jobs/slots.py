"""Numbered places for worker processes of one host, held by file locks, which the kernel releases however a process ends."""

import fcntl
import os
import re
import socket
from pathlib import Path

_NAME = re.compile(r"(?P<executor>.+-\d+)\.lock")


class Slot:
    """A place that this process holds until it ends. The executor id of a place never changes."""

    def __init__(self, executor: str, handle: int) -> None:
        self.executor = executor
        self._handle = handle

    def release(self) -> None:
        """Give the place up."""
        os.close(self._handle)


class Slots:
    """The places of this host in a data folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._host = socket.gethostname()

    def take(self) -> Slot:
        """The lowest free place: after a crash the one that the dead process held."""
        self._folder.mkdir(parents=True, exist_ok=True)
        number = 0
        while (slot := self._try(f"{self._host}-{number}")) is None:
            number += 1
        return slot

    def abandoned(self) -> list[Slot]:
        """Places that were used once and that nobody holds, now held by this process: release each."""
        names = (match["executor"] for path in sorted(self._folder.iterdir()) if (match := _NAME.fullmatch(path.name)))
        slots = (self._try(name) for name in names if name.rpartition("-")[0] == self._host)
        return [slot for slot in slots if slot is not None]

    def _try(self, executor: str) -> Slot | None:
        handle = os.open(self._folder / f"{executor}.lock", os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            return None
        return Slot(executor, handle)
