"""Says that numeric code is compiled: the first command after an installation, and nobody else, spends a minute on it."""

import mmap
from collections.abc import Callable

from numba.core import event

MESSAGE = "compiling numeric code for this machine: about a minute, once; later commands find it ready"


def tell_compiling(say: Callable[[str], object]) -> None:
    """`say` it when something is compiled that no earlier run has left, once in this process and those forked from it."""
    event.register("numba:compile", _Teller(say))


class _Teller(event.Listener):  # type: ignore[misc]  # numba has no types
    def __init__(self, say: Callable[[str], object]) -> None:
        self._say = say
        self._told = mmap.mmap(-1, 1)  # shared with children

    def on_start(self, event: object) -> None:
        if not self._told[0]:
            self._told[0] = 1
            self._say(MESSAGE)

    def on_end(self, event: object) -> None:
        """Of no interest."""
