"""Designs: request, read, and their files."""

import json
from pathlib import PurePosixPath
from typing import Annotated, Literal

from fastapi import APIRouter, Header, Query, Request, Response, status
from fastapi.responses import FileResponse
from sqlalchemy.orm import Session

from gripwright.http.bom import FORMS, JSON, View, bom_response, preferred
from gripwright.http.deps import Actor, Artifacts, Now, Plugins, ReadSession, Service, Traceparent, WriteSession
from gripwright.http.downloads import archive_response, file_response
from gripwright.http.idempotency import ActingRoute
from gripwright.http.pagination import Changes, ChangesRequest, list_answer
from gripwright.http.polling import poll_headers
from gripwright.http.preconditions import IfNoneMatch, IfRange, Range, is_known
from gripwright.http.preferences import PREFER
from gripwright.http.reading import NOT_MODIFIED, Sparse, content_tag
from gripwright.http.schemas.designs import DesignAccepted, DesignPage, DesignRequest, DesignSummary, DesignView
from gripwright.http.schemas.problem import problems
from gripwright.http.schemas.products import product_reference
from gripwright.jobs.requests import request_design
from gripwright.store.designs import DesignRepository, JobRepository, JobTerms
from gripwright.store.jobs import DOCUMENT
from gripwright.store.products import ProductRepository

router = APIRouter(tags=["designs"], route_class=ActingRoute)

DesignStatus = Annotated[
    Literal["queued", "running", "complete", "incomplete", "failed", "cancelled"] | None, Query(description="only those")
]


@router.post(
    "/products/{product_id}/designs",
    operation_id="create_design",
    status_code=status.HTTP_202_ACCEPTED,
    responses={
        201: {"model": DesignView, "description": "It has ended within the time of `Prefer: wait=n`"},
        **problems(404, 409, 415, 422, 507),
    },
    openapi_extra=PREFER,
)
def create_design(
    product_id: str,
    body: DesignRequest,
    session: WriteSession,
    artifacts: Artifacts,
    plugins: Plugins,
    now: Now,
    actor: Actor,
    service: Service,
    traceparent: Traceparent,
    response: Response,
) -> DesignAccepted:
    """Queue a design of this product. Poll `Location`; the BOM is there once its status is `complete` or `incomplete`.

    `Prefer: wait=n` waits for that: where the design ends within n seconds the answer is 201 with the design itself.
    """
    terms = JobTerms(priority=body.priority, client=actor, deadline_s=body.deadline_s or service.settings.design_deadline_s)
    design = request_design(session, artifacts, plugins, product_id, body.options, now, terms)
    design.job.traceparent = traceparent
    response.headers.update(poll_headers(design.job, location=f"/api/v1/designs/{design.id}"))
    return DesignAccepted.of(design)


@router.get("/designs", operation_id="list_designs", response_model=DesignPage, responses={**NOT_MODIFIED, **problems(422)})
def list_designs(
    session: ReadSession,
    changes: Changes,
    sparse: Sparse,
    request: Request,
    status: DesignStatus = None,
    product_id: Annotated[str | None, Query(max_length=32)] = None,
) -> Response:
    """Designs, the newest first, or with `updated_since` in the order of their changes."""
    return list_answer(request, sparse, _page(session, changes, status, product_id))


@router.get(
    "/products/{product_id}/designs",
    operation_id="list_product_designs",
    response_model=DesignPage,
    responses={**NOT_MODIFIED, **problems(404, 422)},
)
def list_product_designs(
    product_id: str, session: ReadSession, changes: Changes, sparse: Sparse, request: Request, status: DesignStatus = None
) -> Response:
    """Designs of a product, the newest first, or with `updated_since` in the order of their changes."""
    ProductRepository(session).get(product_id)
    return list_answer(request, sparse, _page(session, changes, status, product_id))


def _page(session: Session, changes: ChangesRequest, status: str | None, product_id: str | None) -> DesignPage:
    is_outcome = status in ("complete", "incomplete")
    rows = JobRepository(session).page(
        after=changes.page.after,
        limit=changes.page.limit + 1,
        status="succeeded" if is_outcome else status,
        outcome=status if is_outcome else None,
        product_id=product_id,
        updated_since=changes.updated_since,
    )
    shown, next_cursor = changes.cut(rows)
    items = [DesignSummary.of(row.design) for row in shown]
    return DesignPage(items=items, next_cursor=next_cursor, next_updated_since=changes.next_updated_since)


@router.get(
    "/designs/{design_id}",
    operation_id="get_design",
    response_model=DesignView,
    responses={**NOT_MODIFIED, **problems(404, 422)},
    openapi_extra=PREFER,
)
def get_design(design_id: str, session: ReadSession, artifacts: Artifacts, sparse: Sparse) -> Response:
    """Where a design stands; `design` is design.json once it is complete or incomplete, `problem` says why it failed.

    `Prefer: wait=n` answers when it has ended, at the latest after n seconds.
    """
    row = DesignRepository(session).get(design_id)
    document = None
    if row.outcome is not None:
        document = json.loads(artifacts.get(DesignRepository(session).file(design_id, DOCUMENT).sha256))
    return sparse.answer(DesignView.of(row, document), headers=poll_headers(row.job))


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
    accept: Annotated[str, Header(description="which of the three forms", max_length=1000)] = JSON,
    if_none_match: IfNoneMatch = None,
    view: Annotated[View, Query(description="by gripper; flat: each part once, what to order; levels: set, grippers, items")] = (
        "by-gripper"
    ),
) -> Response:
    """What to buy and what to make: JSON, CSV or XLSX."""
    designs = DesignRepository(session)
    stored = designs.file(design_id, DOCUMENT)
    media_type, product = preferred(accept, FORMS), product_reference(designs.get(design_id).product)
    tag = content_tag(json.dumps([stored.sha256, view, media_type, product]).encode())
    headers = {"ETag": tag, "Vary": "Accept"}
    if is_known(if_none_match, tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    return bom_response(json.loads(artifacts.get(stored.sha256)), product, view, media_type, f"bom-{design_id}", headers)


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
    design_id: str,
    path: str,
    session: ReadSession,
    artifacts: Artifacts,
    if_none_match: IfNoneMatch = None,
    if_range: IfRange = None,
    range_: Range = None,
) -> Response:
    """A file of the design folder; its ETag is its sha-256, ranges are served."""
    row = DesignRepository(session).file(design_id, path)
    name = PurePosixPath(row.path).name
    return file_response(artifacts, row.sha256, media_type=row.media_type, name=name, if_none_match=if_none_match)


@router.get(
    "/designs/{design_id}/package.zip",
    operation_id="get_design_package",
    response_class=FileResponse,
    responses={
        200: {"content": {"application/zip": {}}, "description": "The design folder"},
        206: {"description": "The range that was asked for"},
        304: {"description": "Not modified"},
        **problems(404, 416),
    },
)
def get_design_package(
    design_id: str,
    session: ReadSession,
    artifacts: Artifacts,
    if_none_match: IfNoneMatch = None,
    if_range: IfRange = None,
    range_: Range = None,
) -> Response:
    """The whole design folder as an archive; ranges are served."""
    return archive_response(DesignRepository(session).get(design_id), artifacts, if_none_match)
