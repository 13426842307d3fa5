"""Files and archives as responses."""

import hashlib
import tempfile
import zipfile

from fastapi import Response, status
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask
from starlette.datastructures import Headers
from starlette.types import Message, Receive, Scope, Send

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


class _StoredFile(FileResponse):
    """A file whose refusals of a range are problems, too."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        refusal: Message | None = None

        async def checked(message: Message) -> None:
            nonlocal refusal
            if message["type"] == "http.response.start" and message["status"] >= 400:
                refusal = message
            if refusal is None:
                await send(message)

        is_head = scope["state"].get(IS_HEAD, False)
        await super().__call__({**scope, "method": "HEAD"} if is_head else scope, receive, checked)
        if refusal is not None:
            content_range = Headers(raw=refusal["headers"]).get("content-range")
            headers = {} if content_range is None else {"Content-Range": content_range}
            answer = problem(refusal["status"], "bad-range", "the file has no such range", headers=headers)
            await answer(scope, receive, send)


def file_response(artifacts: ArtifactStore, sha256: str, *, media_type: str, name: str, if_none_match: str | None) -> Response:
    """A stored file by its content: pages and tables are shown, CAD files are saved. The ETag is the sha-256."""
    tag = f'"{sha256}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
    if is_known(if_none_match, tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    kind = media_type.partition(";")[0]
    if kind == "text/html":
        headers["Content-Security-Policy"] = _REPORT_POLICY
    return _StoredFile(
        artifacts.path(sha256),
        media_type=media_type,
        headers=headers,
        filename=name,
        content_disposition_type="inline" if kind in _INLINE else "attachment",
    )


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
    return _StoredFile(
        target.name,
        media_type="application/zip",
        headers=headers,
        filename=f"design-{design.id}.zip",
        background=BackgroundTask(target.close),
    )
