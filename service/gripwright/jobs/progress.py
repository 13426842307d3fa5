"""How far a design is, from how far its steps are."""

import threading
import time
from collections.abc import Callable, Sequence

from gripwright.jobs.engine import OnProgress


def design_fraction(stages: Sequence[str], stage: str, steps_done: float, steps: int) -> float:
    """The fraction (0..1) of a design when `steps_done` of the `steps` of one of its stages are done."""
    return (stages.index(stage) + steps_done / max(steps, 1)) / len(stages)


class Throttle:
    """Passes at most one report a second on, always the newest; `flush` passes on what waits and is due."""

    def __init__(self, report: OnProgress, interval_s: float = 1.0, clock: Callable[[], float] = time.monotonic) -> None:
        self._report, self._interval_s, self._clock = report, interval_s, clock
        self._waiting: tuple[float, str, str] | None = None
        self._next_s = clock()
        self._lock = threading.Lock()

    def __call__(self, fraction: float, stage: str, message: str) -> None:
        """Report, now or as soon as the last report is a second old."""
        with self._lock:
            self._waiting = (fraction, stage, message)
        self.flush()

    def flush(self) -> None:
        """Pass on the newest report, where one waits and is due."""
        with self._lock:
            if self._waiting is None or self._clock() < self._next_s:
                return
            report, self._waiting = self._waiting, None
            self._next_s = self._clock() + self._interval_s
        self._report(*report)
