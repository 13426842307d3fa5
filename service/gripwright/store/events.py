"""What happened to jobs: events for Server-Sent Events, and messages to webhooks where a job ends."""

import json
from datetime import datetime
from typing import Any, Literal, get_args

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from gripwright.store.models import DesignRow, JobEventRow, JobRow, WebhookRow
from gripwright.store.webhooks import WebhookRepository

EventName = Literal["design.complete", "design.incomplete", "design.failed", "design.cancelled"]
WEBHOOK_EVENTS: tuple[EventName, ...] = get_args(EventName)


def record_event(session: Session, job: JobRow, kind: str, now: datetime, **more: Any) -> None:
    """Append an event with the job's present state; `kind` is "status", "progress" or "log"."""
    job.updated_at = now
    session.add(JobEventRow(job_id=job.id, kind=kind, data={**job_state(job), **more}, created_at=now))


def job_state(job: JobRow) -> dict[str, Any]:
    """The state of a job as JSON values."""
    return {
        "status": job.status,
        "attempt": job.attempt,
        "priority": job.priority,
        "not_before": None if job.not_before is None else job.not_before.isoformat(),
        "progress": {"fraction": job.fraction, "stage": job.stage, "message": job.message},
        "problem": job.problem,
    }


def queue_webhooks(session: Session, design: DesignRow, status: str, now: datetime) -> None:
    """Queue a message to every subscriber of `design.<status>`, in the transaction that ends the job."""
    event = f"design.{status}"
    data = {"design_id": design.id, "product_id": design.product_id, "status": status}
    payload = json.dumps({"type": event, "timestamp": now.isoformat(), "data": data}, separators=(",", ":"))
    for webhook in session.scalars(select(WebhookRow).where(WebhookRow.enabled.is_(True))):
        if event in webhook.events:
            WebhookRepository(session).queue(webhook, payload, now)


class EventRepository:
    """Events of jobs, as read by listeners."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def after(self, job_id: str, event_id: int, limit: int) -> list[JobEventRow]:
        """Up to `limit` events of a job in order, strictly after `event_id`."""
        query = select(JobEventRow).where(JobEventRow.job_id == job_id, JobEventRow.id > event_id)
        return list(self._session.scalars(query.order_by(JobEventRow.id).limit(limit)))

    def remove_before(self, moment: datetime) -> None:
        """Remove what happened to jobs that ended earlier."""
        over = select(JobRow.id).where(JobRow.finished_at < moment)
        self._session.execute(delete(JobEventRow).where(JobEventRow.job_id.in_(over)))
