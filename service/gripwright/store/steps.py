"""Results of the calculation's steps by the hash of what they were made from."""

import hashlib
import logging
import time
from pathlib import Path

from gripwright.store.files import Files, LocalFiles

log = logging.getLogger(__name__)

_SUFFIX = 32  # bytes of sha-256 behind the data


class StepStore:
    """Step results in a folder or another place. Any process may write a key at any time: whole files replace each other."""

    def __init__(self, place: Path | Files) -> None:
        self.files = LocalFiles(place) if isinstance(place, Path) else place

    def has(self, key: str) -> bool:
        """Whether a result is stored under this key and whole."""
        if not self.files.checks_itself:
            return self.find(key) is not None
        state = self.files.state(_name(key))
        if state is None or time.time() - state.modified_s < self.files.refresh_after_s:
            return state is not None
        return self.find(key) is not None  # to read it renews its time

    def find(self, key: str) -> bytes | None:
        """The result, or None; a damaged one counts as absent, and is removed, so that it is computed again."""
        stored = self.files.read(_name(key))
        if stored is None:
            return None
        data, digest = stored[:-_SUFFIX], stored[-_SUFFIX:]
        if hashlib.sha256(data).digest() != digest:
            log.warning("the stored step result %s is damaged and will be computed again", key)
            self.files.remove(_name(key), time.time())
            return None
        return data

    def save(self, key: str, data: bytes) -> None:
        """Store a result under its key."""
        self.files.write(_name(key), data + hashlib.sha256(data).digest())


def _name(key: str) -> str:
    return f"{key[:2]}/{key}"
