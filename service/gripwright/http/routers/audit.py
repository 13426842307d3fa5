"""The audit trail."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from gripwright.http.deps import ReadSession
from gripwright.http.pagination import Page, link_next
from gripwright.http.schemas.audit import AuditPage, AuditView
from gripwright.http.schemas.problem import problems
from gripwright.store.audit import AuditRepository
from gripwright.store.models import AuditRow
from gripwright.store.pages import Cursor

router = APIRouter(prefix="/audit", tags=["audit"])


@router.get("", operation_id="list_audit", responses=problems(422))
def list_audit(
    session: ReadSession,
    page: Page,
    request: Request,
    response: Response,
    actor: Annotated[str | None, Query(max_length=300)] = None,
    resource_id: Annotated[str | None, Query(max_length=300)] = None,
) -> AuditPage:
    """Who did what, the newest first."""
    rows = AuditRepository(session).page(after=page.after, limit=page.limit + 1, actor=actor, resource_id=resource_id)
    shown, next_cursor = page.cut(rows, _cursor)
    link_next(request, response, next_cursor)
    return AuditPage(items=[AuditView.of(row) for row in shown], next_cursor=next_cursor)


def _cursor(row: AuditRow) -> Cursor:
    return Cursor(created_at=row.created_at, id=row.id)
