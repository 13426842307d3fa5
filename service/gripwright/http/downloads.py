"""Files and archives as responses."""

import hashlib
import re
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from fastapi import Response, status
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask
from starlette.concurrency import iterate_in_threadpool
from starlette.datastructures import Headers
from starlette.types import Receive, Scope, Send

from gripwright.domain.errors import NotFound
from gripwright.http.errors import problem
from gripwright.http.head import IS_HEAD
from gripwright.http.preconditions import is_known
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.models import DesignRow

_INLINE = frozenset({"application/json", "text/csv", "text/html", "image/png"})
_EPOCH = (1980, 1, 1, 0, 0, 0)  # archives of the same files are the same, byte for byte
_REPORT_POLICY = (
    "sandbox allow-scripts; default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
    "frame-ancestors 'none'"
)
_PART_BYTES = 2**20
_RANGE = re.compile(r"\s*bytes\s*=\s*(?P<first>\d{0,18})\s*-\s*(?P<last>\d{0,18})\s*", re.IGNORECASE)


Parts = Callable[[int, int], Iterator[bytes]]
"""Reads a file from one byte up to another."""


class _Download(FileResponse):
    """A file, whole or a range of it, passed on as it is read: from a folder and from other storage alike.

    Several ranges at once are answered with the whole, as the standard allows.
    """

    def __init__(
        self,
        parts: Parts,
        size: int,
        *,
        media_type: str,
        headers: dict[str, str],
        name: str,
        background: BackgroundTask | None = None,
    ) -> None:
        kind = "inline" if media_type.partition(";")[0] in _INLINE else "attachment"
        super().__init__(
            name, media_type=media_type, headers=headers, filename=name, content_disposition_type=kind, background=background
        )
        self._parts, self._size = parts, size

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        start, stop = 0, self._size
        asked = self._asked(Headers(scope=scope))
        if asked is not None:
            start, stop = asked
            if start >= stop:
                headers = {"Content-Range": f"bytes */{self._size}"}
                await problem(416, "bad-range", "the file has no such range", headers=headers)(scope, receive, send)
                return
            self.status_code = status.HTTP_206_PARTIAL_CONTENT
            self.headers["content-range"] = f"bytes {start}-{stop - 1}/{self._size}"
        self.headers["content-length"] = str(stop - start)
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        if scope["method"].upper() != "HEAD" and not scope["state"].get(IS_HEAD, False):
            async for part in iterate_in_threadpool(self._parts(start, stop)):
                await send({"type": "http.response.body", "body": part, "more_body": True})
        await send({"type": "http.response.body", "body": b"", "more_body": False})
        if self.background is not None:
            await self.background()

    def _asked(self, headers: Headers) -> tuple[int, int] | None:
        """Start and stop of the range that is asked for, empty where the file has none of it; None: the whole is."""
        match = _RANGE.fullmatch(headers.get("range", ""))
        if match is None or headers.get("if-range", self.headers["etag"]) != self.headers["etag"]:
            return None
        first, last = match["first"], match["last"]
        if (first and last and int(first) > int(last)) or not (first or last):
            return None  # no range by the standard's grammar: to be ignored
        if not first:
            return max(self._size - int(last), 0), self._size if int(last) else 0
        return int(first), min(int(last) + 1, self._size) if last else self._size


def file_response(artifacts: ArtifactStore, sha256: str, *, media_type: str, name: str, if_none_match: str | None) -> Response:
    """A stored file by its content: pages and tables are shown, CAD files are saved. The ETag is the sha-256."""
    tag = f'"{sha256}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
    if is_known(if_none_match, tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    if media_type.partition(";")[0] == "text/html":
        headers["Content-Security-Policy"] = _REPORT_POLICY
    parts = partial(artifacts.parts, sha256)
    return _Download(parts, artifacts.size(sha256), media_type=media_type, headers=headers, name=name)


def archive_response(design: DesignRow, artifacts: ArtifactStore, if_none_match: str | None) -> Response:
    """All files of a design folder as a .zip. The ETag is the sha-256 of what it holds, and known before it is packed."""
    if not design.files:
        raise NotFound(f"design {design.id} has no files: it is {design.job.status}", design_id=design.id)
    content = "".join(f"{row.sha256} {row.path}\n" for row in design.files)
    tag = f'"{hashlib.sha256(content.encode()).hexdigest()}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
    if is_known(if_none_match, tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    target = tempfile.NamedTemporaryFile(prefix="gripwright-", suffix=".zip")  # noqa: SIM115 - closed, and gone, after the response
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for row in design.files:
            with archive.open(zipfile.ZipInfo(row.path, _EPOCH), "w") as member:
                member.write(artifacts.get(row.sha256))
    target.flush()
    return _Download(
        partial(_parts_of, Path(target.name)),
        target.tell(),
        media_type="application/zip",
        headers=headers,
        name=f"design-{design.id}.zip",
        background=BackgroundTask(target.close),
    )


def _parts_of(path: Path, start: int, stop: int) -> Iterator[bytes]:
    with path.open("rb") as file:
        file.seek(start)
        while (left := stop - file.tell()) > 0 and (part := file.read(min(left, _PART_BYTES))):
            yield part
