"""Surface that must not be touched (paper, section 5.2.1)."""

from dataclasses import dataclass, field
from typing import Any

from gripwright.domain.shape import BoolArray, FloatArray

MARKED = "marked"
"""`detector` of what the user forbade in the package; nothing overrules it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Forbidden:
    """Part of a component's surface that no finger may touch: the faces of `faces`, only inside the box where one is given."""

    reason: str  # "gear teeth"
    detector: str  # key of the plug-in that found it
    faces: BoolArray  # (m,) of the prepared mesh
    box_min_C: FloatArray | None = None  # (3,) closed
    box_max_C: FloatArray | None = None  # (3,)
    evidence: dict[str, Any] = field(default_factory=dict)  # JSON: pitch, count, axis, …
