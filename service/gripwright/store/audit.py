"""All SQL about the audit trail."""

from datetime import datetime

from sqlalchemy import delete, select, tuple_
from sqlalchemy.orm import Session

from gripwright.store.models import AuditRow
from gripwright.store.pages import Cursor


class AuditRepository:
    """The audit trail. Rows are added and, when they are old enough, removed; none is changed."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, row: AuditRow) -> None:
        """Add a row."""
        self._session.add(row)
        self._session.flush()

    def page(self, *, after: Cursor | None, limit: int, actor: str | None, resource_id: str | None) -> list[AuditRow]:
        """Up to `limit` rows, the newest first, strictly after the cursor."""
        query = select(AuditRow).order_by(AuditRow.created_at.desc(), AuditRow.id.desc()).limit(limit)
        if actor is not None:
            query = query.where(AuditRow.actor == actor)
        if resource_id is not None:
            query = query.where(AuditRow.resource_id == resource_id)
        if after is not None:
            query = query.where(tuple_(AuditRow.created_at, AuditRow.id) < (after.created_at, after.id))
        return list(self._session.scalars(query))

    def remove_before(self, moment: datetime) -> None:
        """Remove what is older."""
        self._session.execute(delete(AuditRow).where(AuditRow.created_at < moment))
