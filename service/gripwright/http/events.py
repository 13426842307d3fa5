"""The events of a job as a stream. It polls the table, so any number of API processes can serve it."""

import asyncio
from collections.abc import AsyncIterator, Callable

from fastapi.concurrency import run_in_threadpool
from fastapi.sse import ServerSentEvent

from gripwright.store.designs import JobRepository
from gripwright.store.engines import Database
from gripwright.store.events import EventRepository

POLL_S = 0.25
_PAGE = 500
_FINAL = ("succeeded", "failed", "cancelled")


async def follow_job(
    database: Database, job_id: str, after: int, *, is_ending: Callable[[], bool]
) -> AsyncIterator[ServerSentEvent]:
    """The events after `after`, those to come included; it ends when the job has ended or is gone, or the service ends."""
    while not is_ending():
        events, is_over = await run_in_threadpool(_next_events, database, job_id, after)
        for event in events:
            after = int(event.id or after)
            yield event
        if is_over and len(events) < _PAGE:
            return
        if not events:
            await asyncio.sleep(POLL_S)


def _next_events(database: Database, job_id: str, after: int) -> tuple[list[ServerSentEvent], bool]:
    """Events that are there by now, and whether no more will come."""
    with database.read_sessions() as session:
        job = JobRepository(session).find(job_id)
        rows = EventRepository(session).after(job_id, after, _PAGE)
        events = [
            ServerSentEvent(id=str(row.id), event=row.kind, data={"at": row.created_at.isoformat(), **row.data}) for row in rows
        ]
        return events, job is None or job.status in _FINAL
