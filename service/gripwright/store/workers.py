"""All SQL about worker processes: who works, and since when nothing was heard of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import DateTime, delete, func, inspect, select, update
from sqlalchemy.orm import Session

from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.models import WorkerRow


def database_now(session: Session) -> datetime:
    """The database's clock, the only one that all hosts share; SQLite has that of its one host."""
    if session.get_bind().dialect.name == "sqlite":
        return utc_now()
    return session.execute(select(func.clock_timestamp(type_=DateTime(timezone=True)))).scalar_one()


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerStanding:
    """A worker and how long ago it was heard of, by the database's clock."""

    row: WorkerRow
    silent_s: float


class WorkerRepository:
    """Workers as callers see them."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def all(self) -> list[WorkerStanding]:
        """Every worker that has neither ended nor been taken over, the oldest first."""
        rows = self._session.scalars(select(WorkerRow).order_by(WorkerRow.started_at, WorkerRow.id))
        now = database_now(self._session)
        return [WorkerStanding(row=row, silent_s=max((now - row.heartbeat_at).total_seconds(), 0.0)) for row in rows]


class WorkerRegister:
    """Workers as they see each other: every method is one short transaction of its own and may be called from any thread."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def enter(self, **fields: Any) -> None:
        """Add a worker; `fields` are the columns but for the times."""
        with self._database.write_sessions.begin() as session:
            now = database_now(session)
            session.add(WorkerRow(**fields, started_at=now, heartbeat_at=now, steps=0))

    def beat(self, worker_id: str, steps: int) -> bool:
        """Say that a worker lives and how many steps it runs; false where another one has taken its work over."""
        with self._database.write_sessions.begin() as session:
            change = update(WorkerRow).where(WorkerRow.id == worker_id)
            done: Any = session.execute(change.values(heartbeat_at=database_now(session), steps=steps))
            return bool(done.rowcount)

    def remove(self, worker_id: str, heartbeat_at: datetime | None = None) -> bool:
        """Strike a worker off. With `heartbeat_at` only where it has been silent since; whether this call did it."""
        with self._database.write_sessions.begin() as session:
            query = delete(WorkerRow).where(WorkerRow.id == worker_id)
            if heartbeat_at is not None:
                query = query.where(WorkerRow.heartbeat_at == heartbeat_at)
            done: Any = session.execute(query)
            return bool(done.rowcount)

    def all(self) -> Sequence[WorkerRow]:
        """Every worker that has neither ended nor been taken over."""
        with self._database.read_sessions() as session:
            return list(session.scalars(select(WorkerRow)))


def standing_workers(database: Database) -> list[WorkerStanding]:
    """Every worker; none where the database is so new, or so old, that it has no table of them."""
    if not inspect(database.read_engine).has_table(WorkerRow.__tablename__):
        return []
    with database.read_sessions() as session:
        return WorkerRepository(session).all()
