"""Files by their content: uploads, design files, snapshots. A name never changes its meaning, so nothing is ever overwritten."""

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

from gripwright.domain.errors import NotFound
from gripwright.store.files import Files, LocalFiles
from gripwright.store.quota import Quota

_SHA256 = re.compile(r"[0-9a-f]{64}")


class ArtifactStore:
    """Files named by the sha-256 of their content, in a folder or another place. Safe for any number of processes."""

    def __init__(self, place: Path | Files, quota: Quota | None = None) -> None:
        self.files = LocalFiles(place) if isinstance(place, Path) else place
        self._quota = quota

    def put(self, data: bytes) -> str:
        """Store the bytes; their sha-256 in hex. What is there already counts as used now, so that no sweep takes it away."""
        sha256 = hashlib.sha256(data).hexdigest()
        if self._quota is not None and not self.has(sha256):
            self._quota.require_room(len(data))
        self.files.refresh(artifact_name(sha256), data)
        return sha256

    def require_room(self) -> None:
        """InsufficientStorage where the storage is full already."""
        if self._quota is not None:
            self._quota.require_room(0)

    def has(self, sha256: str) -> bool:
        """Whether it is stored."""
        return _SHA256.fullmatch(sha256) is not None and self.files.state(artifact_name(sha256)) is not None

    def size(self, sha256: str) -> int:
        """How many bytes it has, or `NotFound`."""
        state = self.files.state(self._checked_name(sha256))
        if state is None:
            raise _absent(sha256)
        return state.size

    def get(self, sha256: str) -> bytes:
        """The bytes, or `NotFound`."""
        data = self.files.read(self._checked_name(sha256))
        if data is None:
            raise _absent(sha256)
        return data

    def parts(self, sha256: str, start: int, stop: int) -> Iterator[bytes]:
        """The bytes from `start` up to `stop` of a file that is there, piece by piece."""
        return self.files.parts(artifact_name(sha256), start, stop)

    def _checked_name(self, sha256: str) -> str:
        if _SHA256.fullmatch(sha256) is None:
            raise _absent(sha256)
        return artifact_name(sha256)


def artifact_name(sha256: str) -> str:
    """Where an artifact is, within the place for all of them."""
    return f"{sha256[:2]}/{sha256}"


def _absent(sha256: str) -> NotFound:
    return NotFound("no such file is stored", sha256=sha256)
