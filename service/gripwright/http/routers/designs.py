"""Designs: request, read, and their files."""

import hashlib
import json
from pathlib import PurePosixPath
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response, status
from fastapi.responses import FileResponse

from gripwright.http.bom import View, bom_response
from gripwright.http.deps import Artifacts, Now, Plugins, ReadSession, WriteSession
from gripwright.http.downloads import archive_response, file_response
from gripwright.http.preconditions import IfNoneMatch
from gripwright.http.schemas.designs import DesignAccepted, DesignRequest, DesignView
from gripwright.http.schemas.problem import problems
from gripwright.jobs.requests import request_design, request_design_once
from gripwright.store.designs import DesignRepository
from gripwright.store.jobs import DOCUMENT

router = APIRouter(tags=["designs"])

POLL_AFTER_S = 1


@router.post(
    "/products/{product_id}/designs",
    operation_id="create_design",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(404, 409, 415, 422, 507),
)
def create_design(
    product_id: str,
    body: DesignRequest,
    session: WriteSession,
    artifacts: Artifacts,
    plugins: Plugins,
    now: Now,
    request: Request,
    response: Response,
    idempotency_key: Annotated[str | None, Header(min_length=1, max_length=255)] = None,
) -> DesignAccepted:
    """Queue a design of this product. Poll `Location`; the BOM is there once its status is `complete` or `incomplete`."""
    if idempotency_key is None:
        design = request_design(session, artifacts, plugins, product_id, body.options, now)
    else:
        sha256 = hashlib.sha256(json.dumps([request.url.path, body.options], sort_keys=True).encode()).hexdigest()
        design = request_design_once(
            session, artifacts, plugins, product_id, body.options, now, key=idempotency_key, request_sha256=sha256
        )
    response.headers["Location"] = f"/api/v1/designs/{design.id}"
    response.headers["Retry-After"] = str(POLL_AFTER_S)
    return DesignAccepted.of(design)


@router.get("/designs/{design_id}", operation_id="get_design", responses=problems(404))
def get_design(design_id: str, session: ReadSession, artifacts: Artifacts, response: Response) -> DesignView:
    """Where a design stands; `design` is design.json once it is complete or incomplete, `problem` says why it failed."""
    row = DesignRepository(session).get(design_id)
    document = None
    if row.outcome is not None:
        document = json.loads(artifacts.get(DesignRepository(session).file(design_id, DOCUMENT).sha256))
    if row.job.status in ("queued", "running"):
        response.headers["Retry-After"] = str(POLL_AFTER_S)
    return DesignView.of(row, document)


@router.get(
    "/designs/{design_id}/bom",
    operation_id="get_design_bom",
    response_class=Response,
    responses={
        200: {
            "description": "The bill of materials, by `Accept`",
            "content": {
                "application/json": {},
                "text/csv": {},
                "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet": {},
            },
        },
        **problems(404, 406),
    },
)
def get_design_bom(
    design_id: str,
    session: ReadSession,
    artifacts: Artifacts,
    request: Request,
    view: Annotated[View, Query(description="by gripper; flat: each part once, what to order; levels: set, grippers, items")] = (
        "by-gripper"
    ),
) -> Response:
    """What to buy and what to make: JSON, CSV or XLSX."""
    document = json.loads(artifacts.get(DesignRepository(session).file(design_id, DOCUMENT).sha256))
    return bom_response(document, view, request.headers.get("accept", "*/*"), f"bom-{design_id}")


@router.get(
    "/designs/{design_id}/files/{path:path}",
    operation_id="get_design_file",
    response_class=FileResponse,
    responses={
        206: {"description": "The range that was asked for"},
        304: {"description": "Not modified"},
        **problems(404, 416),
    },
)
def get_design_file(
    design_id: str, path: str, session: ReadSession, artifacts: Artifacts, if_none_match: IfNoneMatch = None
) -> Response:
    """A file of the design folder; its ETag is its sha-256, ranges are served."""
    row = DesignRepository(session).file(design_id, path)
    name = PurePosixPath(row.path).name
    return file_response(artifacts, row.sha256, media_type=row.media_type, name=name, if_none_match=if_none_match)


@router.get(
    "/designs/{design_id}/package.zip",
    operation_id="get_design_package",
    response_class=FileResponse,
    responses={200: {"content": {"application/zip": {}}, "description": "The design folder"}, **problems(404)},
)
def get_design_package(design_id: str, session: ReadSession, artifacts: Artifacts) -> Response:
    """The whole design folder as an archive."""
    return archive_response(DesignRepository(session).get(design_id), artifacts)
