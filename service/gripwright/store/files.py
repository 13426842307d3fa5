"""Files that are there whole or not at all: what the stores need of a place for them, and a folder as such a place."""

import contextlib
import errno
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from gripwright.domain.errors import InsufficientStorage

PART_BYTES = 256 * 1024
"""Of a file that is read piece by piece."""

FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT)
"""Of a disk, or a user's share of it, that is full."""

_TEMPORARY, _PART = ".", ".part"


@dataclass(frozen=True, slots=True, kw_only=True)
class FileState:
    """A stored file."""

    name: str
    size: int
    modified_s: float  # when it was written or used last, up to `refresh_after_s`; seconds since 1970


class Files(Protocol):
    """A place for files by name ("ab/abcd…"). Any process may do anything at any time: no reader sees a part of a file."""

    checks_itself: bool
    """Whether what is read is surely what was written, so that to look for a file it need not be read."""

    refresh_after_s: float
    """How old a file's time may be before its use renews it."""

    def write(self, name: str, data: bytes) -> None:
        """Store a file. It outlives a power cut when this returns."""
        ...

    def read(self, name: str) -> bytes | None:
        """A file, or None."""
        ...

    def state(self, name: str) -> FileState | None:
        """A file's size and time, or None."""
        ...

    def refresh(self, name: str, data: bytes) -> None:
        """Make the time of a file with this content the present, where it is old; store it where it is gone."""
        ...

    def parts(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """The bytes from `start` up to `stop` of a file that is there, piece by piece."""
        ...

    def all(self) -> Iterator[FileState]:
        """Every file, in no order."""
        ...

    def remove(self, name: str, unless_modified_after_s: float) -> bool:
        """Remove a file that was not used after that moment; whether it was removed."""
        ...

    def remove_parts(self, before_s: float) -> int:
        """Remove what writers that died left behind before that moment; how many."""
        ...

    def free_bytes(self) -> int | None:
        """What is left of the disk; None where there is no such limit."""
        ...


class LocalFiles:
    """A folder, on this machine or shared. A file's time is renewed by its use, ten minutes late at most."""

    checks_itself = False
    refresh_after_s = 600.0

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def write(self, name: str, data: bytes) -> None:
        """Write a file so that no reader, and no crash, ever sees a part of it."""
        try:
            write_atomically(self.folder / name, data)
        except OSError as error:
            if error.errno in FULL_ERRNOS:
                raise InsufficientStorage(f"no space is left for {len(data)} bytes: {error.strerror}") from error
            raise

    def read(self, name: str) -> bytes | None:
        """A file, or None."""
        try:
            with (self.folder / name).open("rb") as file:
                if time.time() - os.fstat(file.fileno()).st_mtime > self.refresh_after_s:
                    self._touch(name)
                return file.read()
        except FileNotFoundError:
            return None

    def state(self, name: str) -> FileState | None:
        """A file's size and time, or None."""
        try:
            status = (self.folder / name).stat()
        except FileNotFoundError:
            return None
        return FileState(name=name, size=status.st_size, modified_s=status.st_mtime)

    def refresh(self, name: str, data: bytes) -> None:
        """Make the time of a file with this content the present; store it where it is gone."""
        if not self._touch(name):
            self.write(name, data)

    def parts(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """The bytes from `start` up to `stop` of a file that is there, piece by piece."""
        with (self.folder / name).open("rb") as file:
            file.seek(start)
            while start < stop and (part := file.read(min(PART_BYTES, stop - start))):
                start += len(part)
                yield part

    def all(self) -> Iterator[FileState]:
        """Every file, in no order."""
        for path, status in self._walk():
            if not path.name.startswith(_TEMPORARY):
                name = path.relative_to(self.folder).as_posix()
                yield FileState(name=name, size=status.st_size, modified_s=status.st_mtime)

    def remove(self, name: str, unless_modified_after_s: float) -> bool:
        """Remove a file that was not used after that moment; whether it was removed."""
        path = self.folder / name
        aside = path.with_name(f"{_TEMPORARY}{path.name}{_PART}")
        try:
            os.replace(path, aside)  # from here on a writer finds it gone, and writes it again
            if aside.stat().st_mtime > unless_modified_after_s:
                os.replace(aside, path)
                return False
            aside.unlink()
        except FileNotFoundError:
            return False
        return True

    def remove_parts(self, before_s: float) -> int:
        """Remove what writers that died left behind before that moment; how many."""
        stale = [path for path, status in self._walk() if path.name.startswith(_TEMPORARY) and status.st_mtime < before_s]
        for path in stale:
            path.unlink(missing_ok=True)
        return len(stale)

    def free_bytes(self) -> int | None:
        """What is left of the disk."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return shutil.disk_usage(self.folder).free

    def _walk(self) -> Iterator[tuple[Path, os.stat_result]]:
        for folder, _, names in os.walk(self.folder):
            for name in names:
                path = Path(folder, name)
                with contextlib.suppress(FileNotFoundError):  # another process removed it
                    yield path, path.stat()

    def _touch(self, name: str) -> bool:
        try:
            os.utime(self.folder / name)
        except FileNotFoundError:
            return False
        return True


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file so that no reader, and no crash, ever sees a part of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=_TEMPORARY, suffix=_PART)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Make the rename itself outlive a power cut."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
