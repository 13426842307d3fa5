"""What the host gives a plug-in while it runs."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from gripwright.domain.pad import PAD, Pad
from gripwright.domain.shape import FloatArray


def _ignore(fraction: float, message: str) -> None:
    del fraction, message


@dataclass(frozen=True, slots=True, kw_only=True)
class RunContext:
    """Randomness, progress and timings of one run of one plug-in.

    `progress` takes a fraction (0..1) and a message; it raises `Cancelled` when the caller asked to stop.
    A plug-in adds to `remarks` what a user should know of how it came to its answer, and to `face_values` what it measured on
    each face of the component's mesh, by name ("sdf": shape diameter, mm).
    """

    seed: int = 0
    progress: Callable[[float, str], None] = _ignore
    timings: dict[str, float] = field(default_factory=dict)  # s, "stage.part"
    remarks: list[str] = field(default_factory=list)
    face_values: dict[str, FloatArray] = field(default_factory=dict)  # (m,) each
    min_contact_mm: float = 3.0
    margin_mm: float = 0.1
    pad: Pad = PAD  # on every fingertip

    @property
    def rng(self) -> np.random.Generator:
        """A fresh generator of this run's seed; the same numbers each time it is asked for."""
        return np.random.default_rng(self.seed)

    @contextmanager
    def timed(self, key: str) -> Iterator[None]:
        """Add the seconds of the block to `timings[key]`. Blocks must not nest."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.timings[key] = self.timings.get(key, 0.0) + time.perf_counter() - start
