"""Files in S3-compatible storage, through obstore. Nothing is imported of it where the storage is a folder."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from functools import cache

from obstore.exceptions import BaseError, PermissionDeniedError, UnauthenticatedError
from obstore.store import S3Store

from gripwright.domain.errors import StorageRefused, StorageUnavailable
from gripwright.store.files import PART_BYTES, FileState

_RETRIES, _PATIENCE = 5, timedelta(seconds=30)


class ObjectFiles:
    """A prefix of a bucket. Objects cannot be touched: one that is used when it is a day old is written again."""

    checks_itself = True  # every transfer has its checksum, and what is kept has others
    refresh_after_s = 86_400.0

    def __init__(self, url: str) -> None:
        self._store = _open(url)

    def write(self, name: str, data: bytes) -> None:
        """Store an object; it is there whole, and safe, when this returns."""
        with _explained():
            try:
                self._store.put(name, data)
            except FileNotFoundError as error:
                raise StorageRefused(f"the bucket does not exist: {_first_line(error)}") from error

    def read(self, name: str) -> bytes | None:
        """An object, or None."""
        with _explained():
            try:
                found = self._store.get(name)
                data = bytes(found.bytes())
            except FileNotFoundError:
                return None
        if time.time() - found.meta["last_modified"].timestamp() > self.refresh_after_s:
            self.write(name, data)
        return data

    def state(self, name: str) -> FileState | None:
        """An object's size and time, or None."""
        with _explained():
            try:
                meta = self._store.head(name)
            except FileNotFoundError:
                return None
        return FileState(name=name, size=meta["size"], modified_s=meta["last_modified"].timestamp())

    def refresh(self, name: str, data: bytes) -> None:
        """Write an object with this content again where it is old or gone."""
        state = self.state(name)
        if state is None or time.time() - state.modified_s > self.refresh_after_s:
            self.write(name, data)

    def parts(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """The bytes from `start` up to `stop` of an object that is there, as they arrive."""
        if start >= stop:
            return
        with _explained():
            for part in self._store.get(name, options={"range": (start, stop)}).stream(min_chunk_size=PART_BYTES):
                yield bytes(part)

    def all(self) -> Iterator[FileState]:
        """Every object, in no order."""
        with _explained():
            for page in self._store.list():
                for meta in page:
                    yield FileState(name=meta["path"], size=meta["size"], modified_s=meta["last_modified"].timestamp())

    def remove(self, name: str, unless_modified_after_s: float) -> bool:
        """Remove an object that was not written after that moment; whether it was removed."""
        state = self.state(name)
        if state is None or state.modified_s > unless_modified_after_s:
            return False
        with _explained():
            self._store.delete(name)
        return True

    def remove_parts(self, before_s: float) -> int:
        """None: what writers left behind is not listed; a lifecycle rule of the bucket ends unfinished uploads."""
        return 0

    def free_bytes(self) -> int | None:
        """No limit that we could know."""
        return None


@cache
def _open(url: str) -> S3Store:
    """The store of a URL, one a process: it keeps its connections. Endpoint, region and keys come from `AWS_…` variables."""
    plain = os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")
    return S3Store.from_url(
        url,
        client_options={"allow_http": plain, "connect_timeout": "5s", "timeout": "60s"},
        retry_config={"max_retries": _RETRIES, "retry_timeout": _PATIENCE},
    )


@contextmanager
def _explained() -> Iterator[None]:
    """The library's errors as ours: those that may heal, and those that will not."""
    try:
        yield
    except (PermissionDeniedError, UnauthenticatedError) as error:
        raise StorageRefused(f"the storage refuses the credentials: {_first_line(error)}") from error
    except BaseError as error:
        raise StorageUnavailable(f"the storage does not answer: {_first_line(error)}") from error


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0][:300]
