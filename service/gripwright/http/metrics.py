"""Figures of the service in Prometheus' text format."""

from collections.abc import Iterator, Mapping
from datetime import datetime

from sqlalchemy.orm import Session

from gripwright.store.designs import JobRepository
from gripwright.store.models import JOB_STATUSES


def metrics_text(session: Session, requests: Mapping[tuple[str, str, int], int], now: datetime) -> str:
    """Jobs by status, the age of the oldest queued one, and answered requests."""
    return "\n".join([*_jobs(JobRepository(session), now), *_requests(requests)]) + "\n"


def _jobs(jobs: JobRepository, now: datetime) -> Iterator[str]:
    counts, oldest = jobs.counts(), jobs.oldest_queued()
    yield "# HELP gripwright_jobs Jobs by status."
    yield "# TYPE gripwright_jobs gauge"
    for status in JOB_STATUSES:
        yield f'gripwright_jobs{{status="{status}"}} {counts.get(status, 0)}'
    yield "# HELP gripwright_oldest_queued_seconds Age of the job that has waited longest, 0 where none waits."
    yield "# TYPE gripwright_oldest_queued_seconds gauge"
    yield f"gripwright_oldest_queued_seconds {0.0 if oldest is None else (now - oldest).total_seconds():.3f}"


def _requests(requests: Mapping[tuple[str, str, int], int]) -> Iterator[str]:
    yield "# HELP gripwright_http_requests_total Answered requests."
    yield "# TYPE gripwright_http_requests_total counter"
    for (method, route, status), count in sorted(requests.items()):
        yield f'gripwright_http_requests_total{{method="{method}",route="{route}",status="{status}"}} {count}'
