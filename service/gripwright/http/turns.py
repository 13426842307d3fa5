"""Work that is done while the caller waits: so much at a time, and who waits too long is told to come again."""

import asyncio

from gripwright.http.errors import Busy

_RETRY_AFTER_S = 5


class Turns:
    """At most `count` at work; the others wait in order, without a thread."""

    def __init__(self, count: int, *, wait_s: float) -> None:
        self._count, self._wait_s = count, wait_s
        self._free = asyncio.Semaphore(count)

    async def take(self) -> None:
        """Wait for a turn; Busy where none comes."""
        try:
            async with asyncio.timeout(self._wait_s):
                await self._free.acquire()
        except TimeoutError:
            detail = f"{self._count} requests are worked on, and none has ended in {self._wait_s:g} s"
            raise Busy(detail, retry_after_s=_RETRY_AFTER_S) from None

    def give_back(self) -> None:
        """The turn is over."""
        self._free.release()
