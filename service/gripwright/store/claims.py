"""Which queued design a worker takes next: one write transaction, so that limits hold however many workers ask at once."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Select, and_, func, or_, select, text
from sqlalchemy.orm import Session

from gripwright.store.models import JobRow

_LOCK = 5_071_306  # any number that nothing else locks
ACTIVE = or_(JobRow.status == "running", and_(JobRow.status == "queued", JobRow.dispatched))
"""Running, or taken by a worker that starts it in a moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignLimits:
    """How many designs may run at a time; a running design mostly waits for its steps."""

    per_worker: int = 4
    per_client: int | None = None


def waiting(now: datetime) -> Select[str, int]:
    """(design, attempt) of what may be taken now."""
    is_due = or_(JobRow.not_before.is_(None), JobRow.not_before <= now)
    return select(JobRow.id, JobRow.attempt).where(JobRow.status == "queued", JobRow.dispatched.is_(False), is_due)


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
