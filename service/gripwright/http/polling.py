"""What answers say to callers that will ask again."""

from gripwright.store.models import JobRow

POLL_AFTER_S = 1


def poll_headers(job: JobRow, *, location: str | None = None) -> dict[str, str]:
    """Where to look, and when to ask again while a job has not ended."""
    headers = {} if location is None else {"Location": location}
    if job.status in ("queued", "running"):
        headers["Retry-After"] = str(POLL_AFTER_S)
    return headers
