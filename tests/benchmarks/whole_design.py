"""`gripwright design` as a user runs it, with its time and the most memory that it and its children had together."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

OK = (0, 3)  # complete, or some component has no gripper
_EVERY_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One run of the command."""

    seconds: float
    cpu_seconds: float  # of all its processes, as far as seen; tells what others on the machine do not
    peak_mb: float  # proportional share of all its processes together


def design(package: Path, data: Path, out: Path, settings: Sequence[str] = ()) -> Run:
    """Design the package; what was stored under `data` is used again."""
    command = [sys.executable, "-m", "gripwright.cli", "design", str(package), "--out", str(out)]
    for setting in settings:
        command += ["--set", setting]
    start = time.perf_counter()
    process = subprocess.Popen(
        command, env=os.environ | {"GRIPWRIGHT_DATA": str(data)}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    peak = _Peak(process.pid)
    _, errors = process.communicate()
    seconds = time.perf_counter() - start
    if process.returncode not in OK:
        raise RuntimeError(errors.decode())
    most_mb, cpu_s = peak.stop()
    return Run(seconds=round(seconds, 2), cpu_seconds=round(cpu_s, 2), peak_mb=round(most_mb, 1))


class _Peak:
    """Watches a process and its descendants."""

    def __init__(self, pid: int) -> None:
        self._pid, self._done = pid, threading.Event()
        self._most_mb = self._cpu_s = 0.0
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def stop(self) -> tuple[float, float]:
        """The largest sums seen: MB, and seconds of CPU."""
        self._done.set()
        self._thread.join()
        return self._most_mb, self._cpu_s

    def _watch(self) -> None:
        while not self._done.wait(_EVERY_S):
            family = _family(self._pid)
            self._most_mb = max(self._most_mb, sum(map(_share_mb, family)))
            self._cpu_s = max(self._cpu_s, sum(map(_cpu_s, family)))


def _family(root: int) -> list[int]:
    """The process and all that descend from it."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
        except (OSError, IndexError):
            continue  # it has ended meanwhile
    found = [root]
    for pid in found:  # grows while it is walked
        found += [child for child, parent in parents.items() if parent == pid]
    return found


def _share_mb(pid: int) -> float:
    """Proportional set size: memory that processes share is counted once among them."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024.0


def _cpu_s(pid: int) -> float:
    """What the process and those of its children that it saw end have used."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
