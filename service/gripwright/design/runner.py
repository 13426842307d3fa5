"""How the pipeline asks for its stages. How a stage is run (here, in a child, on another machine, or not at all because its
result is stored) is the runner's business."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

Ref = str
"""Identity of a stored stage result or input: a hash of what it was made from."""


class Runner(Protocol):
    """Runs stages by name."""

    def put(self, value: Any) -> Ref:
        """Store an input by its content."""
        ...

    def get(self, ref: Ref) -> Any:
        """A stored value."""
        ...

    def map(self, stage: str, calls: Sequence[Mapping[str, Any]]) -> list[Ref]:
        """Run one stage on each of `calls`, in parallel where possible; their results in order.

        A call's values are JSON, or refs given as `{"ref": …}` (also inside lists and mappings), which the stage receives
        as values.
        """
        ...
