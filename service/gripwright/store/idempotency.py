"""All SQL about `Idempotency-Key`: which request works under a key, and how it was answered."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import delete, update
from sqlalchemy.orm import Session

from gripwright.domain.errors import Conflict
from gripwright.store.models import IdempotencyRow


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyClaim:
    """A key that one request works under; `id` tells it from every other request under that key."""

    caller_sha256: str
    key: str
    id: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptAnswer:
    """An answer as it is given again, and the request that it answers."""

    request_sha256: str
    status: int
    headers: list[tuple[str, str]]
    body: bytes


class IdempotencyRepository:
    """Keys and their answers. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def find(self, claim: KeyClaim, now: datetime) -> IdempotencyRow | None:
        """Who works, or has answered, under the caller's key; None where nobody does. What has expired is removed."""
        row = self._session.get(IdempotencyRow, (claim.caller_sha256, claim.key), with_for_update=True)
        if row is not None and row.expires_at <= now:
            self._session.delete(row)
            self._session.flush()
            return None
        return row

    def claim(self, claim: KeyClaim, now: datetime, expires_at: datetime) -> None:
        """Take a key that `find` has not found. Of two at the same time one fails on the primary key."""
        row = IdempotencyRow(caller_sha256=claim.caller_sha256, key=claim.key, claim_id=claim.id, created_at=now)
        row.expires_at = expires_at
        self._session.add(row)
        self._session.flush()

    def extend(self, claim: KeyClaim, expires_at: datetime) -> None:
        """Say that the request still works."""
        self._set(claim, expires_at=expires_at)

    def keep(self, claim: KeyClaim, answer: KeptAnswer, expires_at: datetime) -> None:
        """Store the answer. Conflict where another request has taken the key over: the caller's transaction must not commit."""
        values = {
            "request_sha256": answer.request_sha256,
            "status": answer.status,
            "headers": [list(header) for header in answer.headers],
            "body": answer.body,
            "expires_at": expires_at,
        }
        if not self._set(claim, **values):
            raise Conflict("another request took this Idempotency-Key over: repeat to get its answer", key=claim.key)

    def release(self, claim: KeyClaim) -> None:
        """Give a key back unanswered."""
        self._session.execute(delete(IdempotencyRow).where(*_unanswered(claim)))

    def remove_expired(self, now: datetime) -> None:
        """Forget answers that were kept long enough, and requests that will never answer."""
        self._session.execute(delete(IdempotencyRow).where(IdempotencyRow.expires_at <= now))

    def _set(self, claim: KeyClaim, **values: Any) -> bool:
        changed = self._session.execute(
            update(IdempotencyRow).where(*_unanswered(claim)).values(**values).returning(IdempotencyRow.key)
        )
        return changed.first() is not None


def _unanswered(claim: KeyClaim) -> tuple[Any, ...]:
    return (
        IdempotencyRow.caller_sha256 == claim.caller_sha256,
        IdempotencyRow.key == claim.key,
        IdempotencyRow.claim_id == claim.id,
        IdempotencyRow.status.is_(None),
    )
