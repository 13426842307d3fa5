"""The ports of the jobs: what they need of the database, what they need of a job engine, and how a step may fail."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol

from gripwright.domain.errors import GripwrightError, InsufficientStorage, StorageUnavailable

if TYPE_CHECKING:
    from gripwright.store.claims import DesignLimits
    from gripwright.store.jobs import DesignSnapshot, Quarantine, StopReason, Told, WatchedJob

OnProgress = Callable[[float, str, str], None]
"""Takes the fraction of the design that is done (0..1), the stage, and a message."""

JobState = Literal["active", "ended", "unknown"]


class StepFailure(GripwrightError):
    """A step of a design crashed, hung, or ran out of memory; `context` names the stage and, where known, the plug-in."""

    code: ClassVar[str] = "step-failure"


class StepBroke(StepFailure):
    """A step broke its process in a way that does not heal: it crashed, hung, or took more memory than it may."""


class PassingFailure(StepFailure):
    """A failure that may heal by itself, such as a full disk: worth another try, a while later."""


class Quarantined(GripwrightError):
    """A step that broke its process before, with the same inputs, was not tried again."""

    code: ClassVar[str] = "quarantined"


class DeadlineExceeded(GripwrightError):
    """A design was not done by its deadline."""

    code: ClassVar[str] = "deadline-exceeded"


class DesignJobs(Protocol):
    """The designs that wait, run and end, in the database. Every method is a transaction of its own, safe from any thread.

    A design waits in the database itself: its row is the entry of the queue. Attempts count from 1; a retry adds one.
    """

    def claim(self, worker: str, limits: "DesignLimits") -> Sequence[tuple[str, int]]:
        """(design, attempt) that this worker runs next: the most urgent first, as many as the limits allow."""
        ...

    def watched(self) -> "Sequence[WatchedJob]":
        """Those that a worker has taken, and those that wait and whose deadline is over."""
        ...

    def start(self, design_id: str, attempt: int, worker: str) -> bool:
        """Whether this attempt may run: it is queued (and is running from now on) or runs already."""
        ...

    def snapshot(self, design_id: str) -> "DesignSnapshot":
        """The inputs of the design."""
        ...

    def told(self, design_id: str) -> "Told":
        """What its trace says of it."""
        ...

    def record_progress(self, design_id: str, attempt: int, fraction: float, stage: str, message: str) -> None:
        """How far it is. A fraction lower than the recorded one is not recorded."""
        ...

    def record_step(self, design_id: str, attempt: int, stage: str, seconds: float, ending: str) -> None:
        """How a step of it ended, and how long it took."""
        ...

    def forget(self, days: int) -> None:
        """Remove the history of what ended that long ago."""
        ...

    def stop_reason(self, design_id: str, attempt: int) -> "StopReason | None":
        """Why this attempt must not go on, if it must not."""
        ...

    def finish(self, design_id: str, attempt: int, status: str, document: Mapping[str, Any], files: Mapping[str, str]) -> None:
        """It ended with a design, `complete` or `incomplete`; `files` are the design folder's paths and their sha-256."""
        ...

    def fail(self, design_id: str, attempt: int, problem: Mapping[str, Any], *, step: str | None = None) -> None:
        """It ended with a problem, in the step of that key where it is known."""
        ...

    def put_back(self, design_id: str, attempt: int, problem: Mapping[str, Any], *, step: str | None = None) -> None:
        """Its problem may heal: it waits for a further attempt, or has failed where it had too many."""
        ...

    def quarantined(self, key: str) -> "Quarantine | None":
        """Why the step of that key is not to be tried, if it is not."""
        ...

    def quarantine(self, key: str, *, stage: str, plugin: str | None, detail: str) -> None:
        """The step of that key is not to be tried again before a caller asks for it."""
        ...

    def cancelled(self, design_id: str, attempt: int) -> None:
        """It ended because somebody asked."""
        ...


class JobEngine(Protocol):
    """Runs designs durably: what has been submitted ends exactly once, whatever happens to the processes."""

    def start(self) -> None:
        """Begin to work."""
        ...

    def submit(self, design_id: str, attempt: int) -> None:
        """Run one attempt of a design in this process; to submit it again, anywhere, changes nothing."""
        ...

    def state(self, design_id: str, attempt: int) -> JobState:
        """Whether the engine still works on it."""
        ...

    def at_work(self) -> Mapping[str, int]:
        """Every executor that has begun something and not ended it, alive or dead, and how many steps it runs."""
        ...

    def take_over(self, executor: str) -> None:
        """Continue what a dead executor left behind; where several workers do it, each piece is continued by one of them."""
        ...

    def pace(self, *, busy: bool) -> None:
        """Look for work often, or, while there are no designs, seldom."""
        ...

    def stop(self) -> None:
        """Take no more work; what runs is left to whoever starts next."""
        ...


def may_heal(error: GripwrightError) -> bool:
    """Whether it is worth another try, a while later."""
    return isinstance(error, PassingFailure) or error.code in (StorageUnavailable.code, InsufficientStorage.code)


def problem_of(error: GripwrightError) -> dict[str, Any]:
    """An error as JSON: what a failed job shows."""
    return {
        "code": error.code,
        "title": error.code.replace("-", " "),
        "detail": error.detail,
        "stage": error.context.get("stage"),
        "plugin": error.context.get("plugin"),
        "errors": [{"pointer": fault.pointer, "message": fault.message} for fault in error.faults],
    }
