"""All SQL about `Idempotency-Key`."""

from datetime import datetime

from sqlalchemy.orm import Session

from gripwright.domain.errors import InvalidInput
from gripwright.store.models import IdempotencyRow


class IdempotencyRepository:
    """Which design was answered under which key. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def find_design(self, key: str, request_sha256: str) -> str | None:
        """The design that was requested under this key; InvalidInput where the request was another."""
        row = self._session.get(IdempotencyRow, key)
        if row is None:
            return None
        if row.request_sha256 != request_sha256:
            raise InvalidInput("this Idempotency-Key was used for another request", key=key)
        return row.design_id

    def remember(self, key: str, request_sha256: str, design_id: str, now: datetime) -> None:
        """Keep the answer; on PostgreSQL a second request in flight fails on the primary key."""
        self._session.add(IdempotencyRow(key=key, request_sha256=request_sha256, design_id=design_id, created_at=now))
        self._session.flush()
