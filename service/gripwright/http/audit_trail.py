"""The audit trail of requests: who did what, when, and how it was answered."""

import logging
from datetime import UTC, datetime, timedelta
from pathlib import PurePosixPath

from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers
from starlette.types import Message, Scope

from gripwright.domain.access import Principal
from gripwright.store.audit import AuditRepository
from gripwright.store.columns import new_id
from gripwright.store.engines import Database
from gripwright.store.models import AuditRow

_log = logging.getLogger(__name__)

_CLEARING = timedelta(hours=1)
_MINUTE = timedelta(minutes=1)
STRANGERS_A_MINUTE = 100
"""Refused credentials that get a row; more are counted in the metrics alone, so that nobody outside can fill the disk."""


class AuditTrail:
    """Writes a row for each answer to a request that can change something or was refused, and removes rows that are too old."""

    def __init__(self, database: Database, *, days: int, with_reads: bool) -> None:
        self._database, self._kept, self._with_reads = database, timedelta(days=days), with_reads
        self._next_clearing = self._minute_ends = datetime.min.replace(tzinfo=UTC)
        self._strangers = 0  # of this minute

    def holds(self, method: str, status: int, principal: Principal | None, now: datetime) -> bool:
        """Whether an answer of that status to a request of that method gets a row. Called by one thread."""
        if principal is None or status == 429:
            return self._has_room(now)
        return self._with_reads or method not in ("GET", "HEAD", "OPTIONS") or status == 403

    def _has_room(self, now: datetime) -> bool:
        if now >= self._minute_ends:
            self._minute_ends, self._strangers = now + _MINUTE, 0
        self._strangers += 1
        if self._strangers == STRANGERS_A_MINUTE + 1:
            _log.warning("more than %d requests without a valid credential a minute: the others get no row", STRANGERS_A_MINUTE)
        return self._strangers <= STRANGERS_A_MINUTE

    def write(self, row: AuditRow) -> None:
        """Store a row. What was asked is done by now: a database that fails is told to the log, with the row."""
        try:
            self.clear(row.created_at)
            with self._database.write_sessions.begin() as session:
                AuditRepository(session).add(row)
        except SQLAlchemyError:
            _log.exception("not in the audit trail: %s %s %s %s %s", row.actor, row.method, row.path, row.status, row.request_id)

    def clear(self, now: datetime) -> None:
        """Remove rows that are too old, at most once an hour."""
        if now < self._next_clearing:
            return
        self._next_clearing = now + _CLEARING
        with self._database.write_sessions.begin() as session:
            AuditRepository(session).remove_before(now - self._kept)


def audit_row(scope: Scope, start: Message, principal: Principal | None, now: datetime) -> AuditRow:
    """The row of an answered request; no principal stands for a credential that was refused."""
    client = scope.get("client")
    return AuditRow(
        id=new_id(now),
        created_at=now,
        actor=_cell(principal.actor if principal else "", 300),
        actor_name=_cell(principal.name if principal else "", 300),
        client=_cell(client[0] if client else "", 64),
        method=_cell(scope["method"], 20),
        path=_cell(scope["raw_path"].decode("ascii", "replace"), 2000),
        status=start["status"],
        resource_id=_cell(_resource_id(scope, start), 300),
        request_id=scope["state"]["request_id"],
    )


def _resource_id(scope: Scope, start: Message) -> str:
    """The id of what was made, or of what the path names: `maker/model` of an actuator."""
    location = Headers(raw=start["headers"]).get("location")
    if location is not None:
        return PurePosixPath(location).name
    return "/".join(str(value) for value in scope.get("path_params", {}).values())


def _cell(text: str, length: int) -> str:
    """Text that every database stores and every terminal can show."""
    return "".join(character if character.isprintable() else "?" for character in text[:length])
