"""The ports of the jobs: what they need of the database, what they need of a job engine, and how a step may fail."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol

from gripwright.domain.errors import GripwrightError

if TYPE_CHECKING:
    from gripwright.store.jobs import DesignSnapshot, Told

OnProgress = Callable[[float, str, str], None]
"""Takes the fraction of the design that is done (0..1), the stage, and a message."""

JobState = Literal["active", "ended", "unknown"]


class StepFailure(GripwrightError):
    """A step of a design crashed, hung, or ran out of memory; `context` names the stage and, where known, the plug-in."""

    code: ClassVar[str] = "step-failure"


class DesignJobs(Protocol):
    """The designs that wait, run and end, in the database. Every method is a transaction of its own, safe from any thread.

    A design waits in the database itself: its row is the entry of the queue. Attempts count from 1; a retry adds one.
    """

    def undispatched(self, limit: int) -> Sequence[tuple[str, int]]:
        """(design, attempt) that were queued and not yet given to the engine, the oldest first."""
        ...

    def mark_dispatched(self, design_id: str, attempt: int) -> None:
        """The engine has it."""
        ...

    def running(self) -> Sequence[tuple[str, int]]:
        """(design, attempt) that started and have not ended."""
        ...

    def start(self, design_id: str, attempt: int) -> bool:
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

    def cancel_requested(self, design_id: str) -> bool:
        """Whether somebody asked to stop it."""
        ...

    def finish(self, design_id: str, attempt: int, status: str, document: Mapping[str, Any], files: Mapping[str, str]) -> None:
        """It ended with a design, `complete` or `incomplete`; `files` are the design folder's paths and their sha-256."""
        ...

    def fail(self, design_id: str, attempt: int, problem: Mapping[str, Any]) -> None:
        """It ended with a problem."""
        ...

    def cancelled(self, design_id: str, attempt: int) -> None:
        """It ended because somebody asked."""
        ...


class JobEngine(Protocol):
    """Runs designs durably: what has been submitted ends exactly once, whatever happens to the processes."""

    def start(self) -> None:
        """Begin to work, first on what a process of the same slot left behind."""
        ...

    def submit(self, design_id: str, attempt: int) -> None:
        """Run one attempt of a design; to submit it again changes nothing."""
        ...

    def state(self, design_id: str, attempt: int) -> JobState:
        """Whether the engine still works on it."""
        ...

    def take_over(self, executor: str) -> None:
        """Continue what a dead executor left behind."""
        ...

    def stop(self) -> None:
        """Take no more work; what runs is left to whoever starts next."""
        ...


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
