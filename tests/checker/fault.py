"""What the judge has to say."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """A broken promise; `gripper` or `operation` is empty where it concerns none."""

    gripper: str
    operation: str
    promise: str
    detail: str

    def __str__(self) -> str:
        where = " ".join(part for part in (self.gripper, self.operation) if part)
        return f"{where or 'design'}: {self.promise}: {self.detail}"


@dataclass(frozen=True)
class Limits:
    """The options of a design that promises depend on, in mm, and how finely motions are stepped."""

    release_clearance: float = 1.0
    margin: float = 0.1
    min_contact: float = 3.0
    finer: int = 1  # so many steps for one
