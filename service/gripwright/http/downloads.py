"""Files and archives as responses."""

import tempfile
import zipfile

from fastapi import Response, status
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from gripwright.domain.errors import NotFound
from gripwright.http.preconditions import is_known
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.models import DesignRow

_INLINE = frozenset({"application/json", "text/csv", "text/html", "image/png"})
_EPOCH = (1980, 1, 1, 0, 0, 0)  # archives of the same files are the same, byte for byte
_REPORT_POLICY = "sandbox allow-scripts; default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def file_response(artifacts: ArtifactStore, sha256: str, *, media_type: str, name: str, if_none_match: str | None) -> Response:
    """A stored file by its content: pages and tables are shown, CAD files are saved. The ETag is the sha-256."""
    tag = f'"{sha256}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
    if is_known(if_none_match, tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    kind = media_type.partition(";")[0]
    if kind == "text/html":
        headers["Content-Security-Policy"] = _REPORT_POLICY
    return FileResponse(
        artifacts.path(sha256),
        media_type=media_type,
        headers=headers,
        filename=name,
        content_disposition_type="inline" if kind in _INLINE else "attachment",
    )


def archive_response(design: DesignRow, artifacts: ArtifactStore) -> Response:
    """All files of a design folder as a .zip."""
    if not design.files:
        raise NotFound(f"design {design.id} has no files: it is {design.job.status}", design_id=design.id)
    target = tempfile.NamedTemporaryFile(prefix="gripwright-", suffix=".zip")  # noqa: SIM115 - closed, and gone, after the response
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for row in design.files:
            with archive.open(zipfile.ZipInfo(row.path, _EPOCH), "w") as member:
                member.write(artifacts.get(row.sha256))
    target.flush()
    return FileResponse(
        target.name,
        media_type="application/zip",
        filename=f"design-{design.id}.zip",
        background=BackgroundTask(target.close),
    )
