"""Files by their content: uploads, design files, snapshots. A name never changes its meaning, so nothing is ever overwritten."""

import hashlib
import re
from pathlib import Path

from gripwright.domain.errors import NotFound
from gripwright.store.files import write_atomically

_SHA256 = re.compile(r"[0-9a-f]{64}")


class ArtifactStore:
    """A folder of files named by the sha-256 of their content. Safe for any number of processes."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def put(self, data: bytes) -> str:
        """Store the bytes; their sha-256 in hex."""
        sha256 = hashlib.sha256(data).hexdigest()
        path = self._place(sha256)
        if not path.exists():
            write_atomically(path, data)
        return sha256

    def has(self, sha256: str) -> bool:
        """Whether it is stored."""
        return _SHA256.fullmatch(sha256) is not None and self._place(sha256).is_file()

    def path(self, sha256: str) -> Path:
        """Where the file is, or `NotFound`."""
        if not self.has(sha256):
            raise NotFound("no such file is stored", sha256=sha256)
        return self._place(sha256)

    def get(self, sha256: str) -> bytes:
        """The bytes, or `NotFound`."""
        return self.path(sha256).read_bytes()

    def _place(self, sha256: str) -> Path:
        return self._folder / sha256[:2] / sha256
