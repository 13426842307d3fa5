"""The three kinds of "no": Rejection (the method's answer), GripwrightError (the caller can act), anything else (a defect)."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True, slots=True)
class Rejection:
    """An expected "no" of a method: a code to group by and one sentence with the measured value and the limit."""

    code: str
    detail: str


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of an input: where (a JSON pointer or a file name) and what."""

    pointer: str
    message: str


class GripwrightError(Exception):
    """Root of the errors a caller can act on; anything else is a defect."""

    code: ClassVar[str] = "internal"

    def __init__(self, detail: str, *, faults: tuple[Fault, ...] = (), **context: object) -> None:
        super().__init__(detail)
        self.detail, self.faults, self.context = detail, faults, context


class InvalidInput(GripwrightError):
    """A package, a sequence or a plan that cannot be used; `faults` names every place."""

    code = "invalid-input"


class InvalidGeometry(GripwrightError):
    """A mesh or CAD file too poor to use."""

    code = "invalid-geometry"


class InvalidPlan(GripwrightError):
    """An option or plug-in key of the plan that does not exist or is out of range."""

    code = "invalid-plan"


class LimitExceeded(GripwrightError):
    """An input larger than the limits allow (bytes, files, triangles, seconds, memory)."""

    code = "limit-exceeded"


class NotFound(GripwrightError):
    """Nothing with this identity is stored."""

    code = "not-found"


class Conflict(GripwrightError):
    """The identity exists with other content, or the state does not allow the change."""

    code = "conflict"


class PluginFailure(GripwrightError):
    """A plug-in raised, hung or broke its contract; `context` names it."""

    code = "plugin-failure"


class Cancelled(GripwrightError):
    """The caller asked to stop."""

    code = "cancelled"


class StorageUnavailable(GripwrightError):
    """The storage of files does not answer; it may do so later."""

    code = "storage-unavailable"


class StorageRefused(GripwrightError):
    """The storage of files refuses what it is asked; only its operator can change that."""

    code = "storage-refused"


class InsufficientStorage(GripwrightError):
    """There is no room for what would be stored."""

    code = "insufficient-storage"
