"""Whether a design must not go on: somebody asked to stop it, it is over, or it has taken too long."""

import logging
import time

from gripwright.domain.errors import Cancelled
from gripwright.jobs.engine import DeadlineExceeded, DesignJobs
from gripwright.store.engines import PASSING_ERRORS
from gripwright.store.jobs import StopReason

log = logging.getLogger(__name__)

_LOOK_S = 0.25


class StopSign:
    """Asks the database four times a second at most; while it does not answer, the design goes on."""

    def __init__(self, jobs: DesignJobs, design_id: str, attempt: int) -> None:
        self._jobs, self._design_id, self._attempt = jobs, design_id, attempt
        self._next_s = 0.0
        self._reason: StopReason | None = None

    def __call__(self) -> bool:
        """Whether to stop."""
        if self._reason is None and time.monotonic() >= self._next_s:
            try:
                self._reason = self._jobs.stop_reason(self._design_id, self._attempt)
            except PASSING_ERRORS as error:
                log.warning("design %s: nobody knows whether it is to stop: %s", self._design_id, error)
            self._next_s = time.monotonic() + _LOOK_S
        return self._reason is not None

    def error(self) -> Cancelled | DeadlineExceeded:
        """What to raise where it is to stop."""
        return deadline_exceeded() if self._reason == "deadline-exceeded" else Cancelled("the caller asked to stop")

    def check(self) -> None:
        """Cancelled or DeadlineExceeded where it is to stop."""
        if self():
            raise self.error()


def deadline_exceeded() -> DeadlineExceeded:
    """What a design ends with that took too long."""
    return DeadlineExceeded("the design was not done by its deadline")
