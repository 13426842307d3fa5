"""How much the storage may hold."""

import threading
import time
from collections.abc import Callable, Sequence

from gripwright.domain.errors import InsufficientStorage
from gripwright.store.files import Files

_COUNT_S = 60.0  # to count a storage takes a look at each of its files


class Quota:
    """A limit on the bytes in several places together, and on what must stay free on their disk."""

    def __init__(
        self,
        places: Sequence[Files],
        *,
        max_bytes: int | None,
        free_min_bytes: int,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._places, self._max_bytes, self._free_min_bytes, self._clock = places, max_bytes, free_min_bytes, clock
        self._lock = threading.Lock()
        self._used = 0
        self._count_at_s = clock()

    def require_room(self, size: int) -> None:
        """InsufficientStorage where so many more bytes, or already what is there, are too many."""
        for free in {place.free_bytes() for place in self._places} - {None}:
            if free is not None and free - size < self._free_min_bytes:
                raise InsufficientStorage(
                    f"{free} bytes are free on the storage's disk and {size} are needed; {self._free_min_bytes} must stay free"
                )
        if self._max_bytes is not None:
            self._admit(size, self._max_bytes)

    def _admit(self, size: int, max_bytes: int) -> None:
        with self._lock:
            if self._clock() >= self._count_at_s:
                self._used = sum(state.size for place in self._places for state in place.all())
                self._count_at_s = self._clock() + _COUNT_S
            if self._used + size > max_bytes or self._used >= max_bytes:
                raise InsufficientStorage(
                    f"the storage holds {self._used} bytes and {size} more are needed; at most {max_bytes} are allowed"
                )
            self._used += size
