"""Results of the calculation's steps by the hash of what they were made from."""

import hashlib
import logging
from pathlib import Path

from gripwright.store.files import write_atomically

log = logging.getLogger(__name__)

_SUFFIX = 32  # bytes of sha-256 behind the data


class StepStore:
    """A folder of step results. Any process may write the same key at the same time: whole files replace each other."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def has(self, key: str) -> bool:
        """Whether a result is stored under this key and whole."""
        return self.find(key) is not None

    def find(self, key: str) -> bytes | None:
        """The result, or None; a damaged one counts as absent, so that it is computed again."""
        try:
            stored = self._place(key).read_bytes()
        except FileNotFoundError:
            return None
        data, digest = stored[:-_SUFFIX], stored[-_SUFFIX:]
        if hashlib.sha256(data).digest() != digest:
            log.warning("the stored step result %s is damaged and will be computed again", key)
            return None
        return data

    def save(self, key: str, data: bytes) -> None:
        """Store a result under its key."""
        write_atomically(self._place(key), data + hashlib.sha256(data).digest())

    def _place(self, key: str) -> Path:
        return self._folder / key[:2] / key
