"""Jobs: list, follow, cancel, retry."""

from collections.abc import AsyncIterator
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Header, Query, Request, Response, status
from fastapi.sse import EventSourceResponse, ServerSentEvent

from gripwright.http.deps import Now, ReadSession, Service, WriteSession
from gripwright.http.events import follow_job
from gripwright.http.idempotency import ActingRoute
from gripwright.http.pagination import Changes, list_answer
from gripwright.http.polling import poll_headers
from gripwright.http.preferences import PREFER
from gripwright.http.reading import NOT_MODIFIED, Sparse
from gripwright.http.schemas.designs import JobPage, JobPatch, JobView
from gripwright.http.schemas.problem import problems
from gripwright.store.designs import JobRepository

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=ActingRoute)

JobStatus = Literal["queued", "running", "succeeded", "failed", "cancelled"]


@router.get("", operation_id="list_jobs", response_model=JobPage, responses={**NOT_MODIFIED, **problems(422)})
def list_jobs(
    session: ReadSession,
    changes: Changes,
    sparse: Sparse,
    request: Request,
    status: Annotated[JobStatus | None, Query()] = None,
    product_id: Annotated[str | None, Query(max_length=32)] = None,
) -> Response:
    """Jobs, the newest first, or with `updated_since` in the order of their changes."""
    rows = JobRepository(session).page(
        after=changes.page.after,
        limit=changes.page.limit + 1,
        status=status,
        product_id=product_id,
        updated_since=changes.updated_since,
    )
    shown, next_cursor = changes.cut(rows)
    page = JobPage(
        items=[JobView.of(row) for row in shown], next_cursor=next_cursor, next_updated_since=changes.next_updated_since
    )
    return list_answer(request, sparse, page)


@router.get(
    "/{job_id}",
    operation_id="get_job",
    response_model=JobView,
    responses={**NOT_MODIFIED, **problems(404, 422)},
    openapi_extra=PREFER,
)
def get_job(job_id: str, session: ReadSession, sparse: Sparse) -> Response:
    """Where a job stands. `Prefer: wait=n` answers when it has ended, at the latest after n seconds."""
    row = JobRepository(session).get(job_id)
    return sparse.answer(JobView.of(row), headers=poll_headers(row))


@router.patch("/{job_id}", operation_id="change_job", responses=problems(404, 409, 415, 422))
def change_job(job_id: str, body: JobPatch, session: WriteSession, now: Now) -> JobView:
    """Let a queued job wait with another priority."""
    jobs = JobRepository(session)
    job = jobs.get(job_id)
    jobs.prioritise(job, body.priority, now)
    return JobView.of(job)


@router.post(
    "/{job_id}/cancel",
    operation_id="cancel_job",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(404, 409),
)
def cancel_job(job_id: str, session: WriteSession, now: Now, response: Response) -> JobView:
    """Stop a job: a queued one at once, a running one within a second."""
    jobs = JobRepository(session)
    job = jobs.get(job_id)
    jobs.cancel(job, now)
    response.headers.update(poll_headers(job, location=f"/api/v1/jobs/{job.id}"))
    return JobView.of(job)


@router.post(
    "/{job_id}/retry",
    operation_id="retry_job",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(404, 409),
)
def retry_job(job_id: str, session: WriteSession, now: Now, response: Response) -> JobView:
    """Queue a failed or cancelled job again; steps that finished do not run again."""
    jobs = JobRepository(session)
    job = jobs.get(job_id)
    jobs.retry(job, now)
    response.headers.update(poll_headers(job, location=f"/api/v1/jobs/{job.id}"))
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
    """Server-Sent Events `status`, `progress` and `log` (how a step ended), or those after `Last-Event-ID`, until the end."""
    async for event in follow_job(service.database, job, last_event_id, is_ending=lambda: service.is_ending):
        yield event
