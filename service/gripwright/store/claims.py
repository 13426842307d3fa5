"""Which queued design a worker takes next: one write transaction, so that limits hold however many workers ask at once."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import BindParameter, ColumnElement, Connection, Select, and_, bindparam, func, or_, select, text
from sqlalchemy.orm import Session

from gripwright.store.columns import UtcDateTime
from gripwright.store.models import JobRow

_LOCK = 5_071_306  # any number that nothing else locks
_JOB = JobRow.__table__.c
ACTIVE = or_(JobRow.status == "running", and_(JobRow.status == "queued", JobRow.dispatched))
"""Running, or taken by a worker that starts it in a moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignLimits:
    """How many designs may run at a time; a running design mostly waits for its steps."""

    per_worker: int = 4
    per_client: int | None = None


def _is_waiting(now: datetime | BindParameter[datetime]) -> ColumnElement[bool]:
    return and_(_JOB.status == "queued", _JOB.dispatched.is_(False), or_(_JOB.not_before.is_(None), _JOB.not_before <= now))


def waiting(now: datetime) -> Select[str, int]:
    """(design, attempt) of what may be taken now."""
    return select(JobRow.id, JobRow.attempt).where(_is_waiting(now))


_ANY_WAITING = select(_JOB.id).where(_is_waiting(bindparam("now", type_=UtcDateTime()))).limit(1)  # built once


def is_any_waiting(connection: Connection, now: datetime) -> bool:
    """Whether anything may be taken now: asked several times a second by every worker, hence of the connection itself."""
    return connection.execute(_ANY_WAITING, {"now": now}).first() is not None


def claim(session: Session, worker: str, limits: DesignLimits, now: datetime) -> list[tuple[str, int]]:
    """Give a worker the designs that it may run: the most urgent first, then those of clients with few running, then the oldest.

    The session must be of a write transaction, of which SQLite has one at a time; PostgreSQL needs the lock.
    """
    if session.get_bind().dialect.name == "postgresql":
        session.execute(text(f"SELECT pg_advisory_xact_lock({_LOCK})"))
    own = session.scalar(select(func.count()).where(ACTIVE, JobRow.worker == worker)) or 0
    taken: list[tuple[str, int]] = []
    while own + len(taken) < limits.per_worker:
        job = session.scalar(_next(limits, now))
        if job is None:
            break
        job.dispatched, job.worker, job.not_before = True, worker, None
        session.flush()
        taken.append((job.id, job.attempt))
    return taken


def _next(limits: DesignLimits, now: datetime) -> Select[JobRow]:
    running = select(JobRow.client, func.count().label("number")).where(ACTIVE).group_by(JobRow.client).subquery()
    number = func.coalesce(running.c.number, 0)
    query = (
        select(JobRow)
        .outerjoin(running, running.c.client == JobRow.client)
        .where(JobRow.id.in_(waiting(now).with_only_columns(JobRow.id)))
    )
    if limits.per_client is not None:
        query = query.where(number < limits.per_client)
    return query.order_by(JobRow.priority.desc(), number, JobRow.created_at, JobRow.id).limit(1)
