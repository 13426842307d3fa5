"""Jobs: list, follow, cancel, retry."""

from collections.abc import AsyncIterator
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Header, Query, Request, Response, status
from fastapi.sse import EventSourceResponse, ServerSentEvent

from gripwright.http.deps import Now, ReadSession, Service, WriteSession
from gripwright.http.events import follow_job
from gripwright.http.pagination import Page, link_next
from gripwright.http.schemas.designs import JobPage, JobView
from gripwright.http.schemas.problem import problems
from gripwright.store.designs import JobRepository
from gripwright.store.models import JobRow
from gripwright.store.pages import Cursor

router = APIRouter(prefix="/jobs", tags=["jobs"])

JobStatus = Literal["queued", "running", "succeeded", "failed", "cancelled"]


@router.get("", operation_id="list_jobs", responses=problems(422))
def list_jobs(
    session: ReadSession,
    page: Page,
    request: Request,
    response: Response,
    status: Annotated[JobStatus | None, Query()] = None,
    product_id: Annotated[str | None, Query(max_length=32)] = None,
) -> JobPage:
    """Jobs, the newest first."""
    rows = JobRepository(session).page(after=page.after, limit=page.limit + 1, status=status, product_id=product_id)
    shown, next_cursor = page.cut(rows, _cursor)
    link_next(request, response, next_cursor)
    return JobPage(items=[JobView.of(row) for row in shown], next_cursor=next_cursor)


@router.get("/{job_id}", operation_id="get_job", responses=problems(404))
def get_job(job_id: str, session: ReadSession) -> JobView:
    """Where a job stands."""
    return JobView.of(JobRepository(session).get(job_id))


@router.post(
    "/{job_id}/cancel",
    operation_id="cancel_job",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(404, 409),
)
def cancel_job(job_id: str, session: WriteSession, now: Now) -> JobView:
    """Stop a job: a queued one at once, a running one within a second."""
    jobs = JobRepository(session)
    job = jobs.get(job_id)
    jobs.cancel(job, now)
    return JobView.of(job)


@router.post(
    "/{job_id}/retry",
    operation_id="retry_job",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(404, 409),
)
def retry_job(job_id: str, session: WriteSession, now: Now) -> JobView:
    """Queue a failed or cancelled job again; steps that finished do not run again."""
    jobs = JobRepository(session)
    job = jobs.get(job_id)
    jobs.retry(job, now)
    return JobView.of(job)


def existing_job(job_id: str, session: ReadSession) -> str:
    """The id of a job that exists: a stream cannot answer 404 once it has begun."""
    return JobRepository(session).get(job_id).id


@router.get(
    "/{job_id}/events",
    operation_id="follow_job",
    response_class=EventSourceResponse,
    responses=problems(404),
)
async def follow_job_events(
    job: Annotated[str, Depends(existing_job, scope="function")],
    service: Service,
    last_event_id: Annotated[int, Header(ge=0, le=2**63 - 1, description="go on after this event")] = 0,
) -> AsyncIterator[ServerSentEvent]:
    """Server-Sent Events `status` and `progress` from the beginning, or after `Last-Event-ID`, until the job has ended."""
    async for event in follow_job(service.database, job, last_event_id, is_ending=lambda: service.is_ending):
        yield event


def _cursor(row: JobRow) -> Cursor:
    return Cursor(created_at=row.created_at, id=row.id)
