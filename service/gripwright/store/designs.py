"""All SQL about designs, their files and jobs as callers see them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import func, select, tuple_
from sqlalchemy.orm import Session, contains_eager, joinedload

from gripwright.domain.errors import Conflict, NotFound
from gripwright.store.events import queue_webhooks, record_event
from gripwright.store.models import DesignFileRow, DesignRow, JobRow
from gripwright.store.pages import Cursor
from gripwright.store.quarantine import QuarantineRepository

PRIORITY_MAX, PRIORITY = 9, 5


@dataclass(frozen=True, slots=True, kw_only=True)
class JobTerms:
    """How a design waits and how long it may take."""

    priority: int = PRIORITY  # 0 to PRIORITY_MAX, the most urgent
    client: str = "anonymous"  # who asks
    deadline_s: float | None = None  # from the request to the end


USUAL_TERMS = JobTerms()


class DesignRepository:
    """Designs. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, design: DesignRow, now: datetime, terms: JobTerms = USUAL_TERMS) -> None:
        """Add a design with its job, queued: the row is the entry in the queue."""
        design.job = JobRow(
            id=design.id,
            status="queued",
            fraction=0.0,
            stage="",
            message="",
            attempt=1,
            dispatched=False,
            cancel_requested=False,
            problem=None,
            created_at=now,
            started_at=None,
            finished_at=None,
            priority=terms.priority,
            client=terms.client,
            deadline_s=terms.deadline_s,
            deadline_at=_after(terms.deadline_s, now),
            not_before=None,
            recoveries=0,
            worker="",
            failed_step=None,
            updated_at=now,
        )
        self._session.add(design)
        self._session.flush()
        record_event(self._session, design.job, "status", now)

    def get(self, design_id: str) -> DesignRow:
        """The design, or `NotFound`."""
        row = self._session.get(DesignRow, design_id)
        if row is None:
            raise NotFound(f"no design {design_id}", design_id=design_id)
        return row

    def latest_complete(self, product_id: str) -> DesignRow | None:
        """The newest complete design of a product."""
        query = select(DesignRow).where(DesignRow.product_id == product_id, DesignRow.outcome == "complete")
        return self._session.scalar(query.order_by(DesignRow.created_at.desc(), DesignRow.id.desc()).limit(1))

    def find_like(self, product_id: str, task_sha256: str, options: Mapping[str, Any]) -> DesignRow | None:
        """The newest design of that task with the same options, whatever has become of it."""
        query = select(DesignRow).where(DesignRow.product_id == product_id, DesignRow.task_sha256 == task_sha256)
        rows = self._session.scalars(query.order_by(DesignRow.created_at.desc(), DesignRow.id.desc()))
        return next((row for row in rows if row.options == options), None)

    def file(self, design_id: str, path: str) -> DesignFileRow:
        """A file of a design folder, or `NotFound`."""
        self.get(design_id)
        row = self._session.get(DesignFileRow, (design_id, path))
        if row is None:
            raise NotFound(f"design {design_id} has no file {path}", design_id=design_id, path=path)
        return row

    def latest_file(self, product_id: str, path: str) -> DesignFileRow | None:
        """The file of that path in the newest design of a product that has one."""
        query = select(DesignFileRow).join(DesignRow).where(DesignRow.product_id == product_id, DesignFileRow.path == path)
        return self._session.scalar(query.order_by(DesignRow.created_at.desc(), DesignRow.id.desc()).limit(1))


class JobRepository:
    """Jobs, as callers see and steer them; `store.jobs` is the workers' side."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def get(self, job_id: str) -> JobRow:
        """The job, or `NotFound`."""
        row = self.find(job_id)
        if row is None:
            raise NotFound(f"no job {job_id}", job_id=job_id)
        return row

    def find(self, job_id: str) -> JobRow | None:
        """The job, if it is there still."""
        return self._session.get(JobRow, job_id, options=[joinedload(JobRow.design)])

    def page(
        self,
        *,
        after: Cursor | None,
        limit: int,
        status: str | None = None,
        outcome: str | None = None,
        product_id: str | None = None,
        updated_since: datetime | None = None,
    ) -> list[JobRow]:
        """Up to `limit` jobs strictly after the cursor, the newest first; with `updated_since`, in order of (updated_at, id)."""
        query = select(JobRow).join(JobRow.design).options(contains_eager(JobRow.design).joinedload(DesignRow.product))
        if status is not None:
            query = query.where(JobRow.status == status)
        if outcome is not None:
            query = query.where(DesignRow.outcome == outcome)
        if product_id is not None:
            query = query.where(DesignRow.product_id == product_id)
        if updated_since is None:
            query = query.order_by(JobRow.created_at.desc(), JobRow.id.desc())
            if after is not None:
                query = query.where(tuple_(JobRow.created_at, JobRow.id) < (after.created_at, after.id))
        else:
            query = query.where(JobRow.updated_at >= updated_since).order_by(JobRow.updated_at, JobRow.id)
            if after is not None:
                query = query.where(tuple_(JobRow.updated_at, JobRow.id) > (after.created_at, after.id))
        return list(self._session.scalars(query.limit(limit)))

    def unfinished(self, job_ids: Iterable[str]) -> set[str]:
        """Those of the jobs that are queued or running."""
        return set(
            self._session.scalars(select(JobRow.id).where(JobRow.id.in_(job_ids), JobRow.status.in_(("queued", "running"))))
        )

    def counts(self) -> dict[str, int]:
        """How many jobs there are of each status."""
        query = select(JobRow.status, func.count().label("jobs")).group_by(JobRow.status)
        return {row.status: row.jobs for row in self._session.execute(query)}

    def oldest_queued(self) -> datetime | None:
        """When the job that has waited longest was created."""
        return self._session.scalar(select(func.min(JobRow.created_at)).where(JobRow.status == "queued"))

    def cancel(self, job: JobRow, now: datetime) -> None:
        """A queued job is cancelled at once, a running one as soon as its worker notices; Conflict where it has ended."""
        if job.status == "queued":
            job.status, job.finished_at = "cancelled", now
            record_event(self._session, job, "status", now)
            queue_webhooks(self._session, job.design, "cancelled", now)
        elif job.status == "running":
            job.cancel_requested, job.updated_at = True, now
        elif job.status != "cancelled":
            raise Conflict(f"the job has {job.status}: only a queued or running one can be cancelled", status=job.status)

    def prioritise(self, job: JobRow, priority: int, now: datetime) -> None:
        """Let a queued job wait with another priority; Conflict where it waits no longer."""
        if job.status != "queued":
            raise Conflict(f"the job is {job.status}: the priority of a queued one can be changed", status=job.status)
        if job.priority != priority:
            job.priority = priority
            record_event(self._session, job, "status", now)

    def retry(self, job: JobRow, now: datetime) -> None:
        """Queue a failed or cancelled job again; its finished steps are stored and do not run again. Else Conflict.

        The step that it failed in is released from quarantine, and its time begins anew.
        """
        if job.status not in ("failed", "cancelled"):
            raise Conflict(f"the job is {job.status}: only a failed or cancelled one can be retried", status=job.status)
        job.status, job.attempt, job.dispatched, job.cancel_requested = "queued", job.attempt + 1, False, False
        job.fraction, job.stage, job.message, job.problem = 0.0, "", "", None
        job.started_at = job.finished_at = None
        if job.failed_step is not None:
            QuarantineRepository(self._session).release(job.failed_step)
        job.failed_step, job.recoveries, job.not_before = None, 0, None
        job.deadline_at = _after(job.deadline_s, now)
        record_event(self._session, job, "status", now)


def _after(deadline_s: float | None, now: datetime) -> datetime | None:
    return None if deadline_s is None else now + timedelta(seconds=deadline_s)
