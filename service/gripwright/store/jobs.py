"""Jobs as workers see them: every method is one short transaction of its own and may be called from any thread."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Literal, NamedTuple

from sqlalchemy import and_, or_, select
from sqlalchemy.orm import Session

from gripwright.settings import Settings
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.claims import ACTIVE, DesignLimits, claim, waiting
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.events import EventRepository, queue_webhooks, record_event
from gripwright.store.media_types import media_type_of
from gripwright.store.models import DesignFileRow, DesignRow, JobRow
from gripwright.store.quarantine import QuarantineRepository
from gripwright.store.step_stats import DESIGN, Ended, StepStatRepository, kind_of
from gripwright.store.storage import open_artifacts

DOCUMENT = "design.json"
PAUSES_S = (1.0, 5.0, 20.0, 60.0, 180.0)
"""Before each further try of a job whose problem may heal."""

StopReason = Literal["cancelled", "deadline-exceeded"]
_OPEN = ("queued", "running")


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignSnapshot:
    """What a design is made from, as it stood when it was requested."""

    task_sha256: str  # artifact: record of an AssemblyTask
    actuators_sha256: str  # artifact: record of a tuple of Actuator
    options: dict[str, Any]
    priority: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Quarantine:
    """Why a step is not tried again."""

    times: int
    detail: str
    plugin: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What a trace says of a job."""

    traceparent: str | None  # of the request that asked for it
    status: str
    code: str | None  # of the problem
    started_at: datetime | None


class WatchedJob(NamedTuple):
    """A job that a worker has taken, or whose deadline is over."""

    design_id: str
    attempt: int
    status: str  # "queued": taken and not yet started; "running"
    is_late: bool


class StoredDesignJobs:
    """The queue of designs in the database. A job ends exactly once: what comes after its end changes nothing."""

    def __init__(self, database: Database, artifacts: ArtifactStore) -> None:
        self._database, self._artifacts = database, artifacts

    def undispatched(self, limit: int) -> Sequence[tuple[str, int]]:
        """(design id, attempt) of queued jobs that a worker may take now, the oldest first."""
        return self._pairs(waiting(utc_now()).order_by(JobRow.created_at, JobRow.id).limit(limit))

    def claim(self, worker: str, limits: DesignLimits) -> Sequence[tuple[str, int]]:
        """(design id, attempt) of the jobs that a worker runs next, its own from now on."""
        if not self.undispatched(1):  # most looks end here, without a write transaction
            return ()
        with self._database.write_sessions.begin() as session:
            return claim(session, worker, limits, utc_now())

    def watched(self) -> Sequence[WatchedJob]:
        """The jobs that somebody must look after: all but those that may still wait."""
        now = utc_now()
        is_late = and_(JobRow.status == "queued", JobRow.deadline_at <= now)
        query = select(JobRow.id, JobRow.attempt, JobRow.status, JobRow.deadline_at).where(or_(ACTIVE, is_late))
        with self._database.read_sessions() as session:
            rows = session.execute(query).all()
        return [
            WatchedJob(row.id, row.attempt, row.status, row.deadline_at is not None and row.deadline_at <= now) for row in rows
        ]

    def start(self, design_id: str, attempt: int, worker: str = "") -> bool:
        """Queued → running; also true where this attempt runs already (recovery), false where it was cancelled or is over."""
        with self._attempt(design_id, attempt, _OPEN) as (session, job):
            if job is None:
                return False
            job.worker = worker
            if job.status == "queued":
                job.status, job.started_at, job.dispatched = "running", utc_now(), True
                record_event(session, job, "status", utc_now())
            return True

    def snapshot(self, design_id: str) -> DesignSnapshot:
        """What the design is made from."""
        with self._database.read_sessions() as session:
            row = session.get_one(DesignRow, design_id)
            return DesignSnapshot(
                task_sha256=row.task_sha256,
                actuators_sha256=row.actuators_sha256,
                options=row.options,
                priority=row.job.priority,
            )

    def told(self, design_id: str) -> Told:
        """What its trace says of a job."""
        with self._database.read_sessions() as session:
            row = session.get_one(JobRow, design_id)
            code = None if row.problem is None else row.problem["code"]
            return Told(traceparent=row.traceparent, status=row.status, code=code, started_at=row.started_at)

    def record_progress(self, design_id: str, attempt: int, fraction: float, stage: str, message: str) -> None:
        """Where the job stands. Progress never goes back within an attempt."""
        with self._attempt(design_id, attempt, ("running",)) as (session, job):
            if job is not None:
                job.fraction, job.stage, job.message = max(job.fraction, min(fraction, 1.0)), stage, message
                record_event(session, job, "progress", utc_now())

    def record_step(self, design_id: str, attempt: int, stage: str, seconds: float, ending: str) -> None:
        """How a step ended, for the job's history."""
        with self._attempt(design_id, attempt, ("running",)) as (session, job):
            if job is not None:
                record_event(session, job, "log", utc_now(), log={"stage": stage, "seconds": seconds, "message": ending})

    def forget(self, days: int) -> None:
        """Remove the events of jobs that ended that long ago, and what was quarantined so long ago."""
        moment = utc_now() - timedelta(days=days)
        with self._database.write_sessions.begin() as session:
            EventRepository(session).remove_before(moment)
            QuarantineRepository(session).remove_before(moment)

    def stop_reason(self, design_id: str, attempt: int) -> StopReason | None:
        """Why an attempt must not go on: the caller asked to stop, it is gone or over, or it has taken too long."""
        query = select(JobRow.status, JobRow.attempt, JobRow.cancel_requested, JobRow.deadline_at).where(JobRow.id == design_id)
        with self._database.read_sessions() as session:
            row = session.execute(query).first()
        if row is None or row.cancel_requested or row.attempt != attempt or row.status not in _OPEN:
            return "cancelled"
        return "deadline-exceeded" if row.deadline_at is not None and row.deadline_at <= utc_now() else None

    def finish(self, design_id: str, attempt: int, status: str, document: Mapping[str, Any], files: Mapping[str, str]) -> None:
        """The design is there: `status` complete or incomplete, its document, and path → artifact of its files."""
        stored = dict(files)
        if DOCUMENT not in stored:
            stored[DOCUMENT] = self._artifacts.put(json.dumps(document, indent=1).encode())
        with self._attempt(design_id, attempt, ("running",)) as (session, job):
            if job is None:
                return
            job.design.outcome = status
            job.design.files = [self._file_row(design_id, path, sha256) for path, sha256 in sorted(stored.items())]
            job.fraction, job.stage, job.message = 1.0, "done", f"the design is {status}"
            self._end(session, job, "succeeded", status)

    def fail(self, design_id: str, attempt: int, problem: Mapping[str, Any], *, step: str | None = None) -> None:
        """The job ended with a problem, in that step where it is known. One that still waits can fail, too: by its deadline."""
        with self._attempt(design_id, attempt, _OPEN) as (session, job):
            if job is not None:
                self._fail(session, job, problem, step)

    def put_back(self, design_id: str, attempt: int, problem: Mapping[str, Any], *, step: str | None = None) -> None:
        """Queue a job again, later each time, since its problem may heal by itself; after the last time it has failed.

        It is a further attempt: what the one before still does changes nothing any more.
        """
        with self._attempt(design_id, attempt, ("running",)) as (session, job):
            if job is None:
                return
            if job.recoveries >= len(PAUSES_S):
                detail = f"{problem['detail']} (tried {job.recoveries + 1} times)"
                self._fail(session, job, {**problem, "detail": detail}, step)
                return
            now = utc_now()
            job.not_before = now + timedelta(seconds=PAUSES_S[job.recoveries])
            job.message = f"{problem['detail']}: tried again in {PAUSES_S[job.recoveries]:g} s"
            job.status, job.attempt, job.dispatched = "queued", job.attempt + 1, False
            job.recoveries, job.fraction = job.recoveries + 1, 0.0
            record_event(session, job, "status", now)

    def cancelled(self, design_id: str, attempt: int) -> None:
        """The job was stopped as the caller asked."""
        with self._attempt(design_id, attempt, ("running",)) as (session, job):
            if job is not None:
                self._end(session, job, "cancelled", "cancelled")

    def quarantined(self, key: str) -> Quarantine | None:
        """How often a step broke its process and how, if it is not to be tried again."""
        with self._database.read_sessions() as session:
            row = QuarantineRepository(session).find(key)
            return None if row is None else Quarantine(times=row.times, detail=row.detail, plugin=row.plugin)

    def quarantine(self, key: str, *, stage: str, plugin: str | None, detail: str) -> None:
        """A step broke its process: it is not tried again before a caller asks for it."""
        with self._database.write_sessions.begin() as session:
            QuarantineRepository(session).add(key, stage=stage, plugin=plugin, detail=detail, now=utc_now())

    def _fail(self, session: Session, job: JobRow, problem: Mapping[str, Any], step: str | None) -> None:
        job.problem, job.failed_step = dict(problem), step
        self._end(session, job, "failed", "failed")

    def _end(self, session: Session, job: JobRow, status: str, event: str) -> None:
        now = utc_now()
        job.status, job.finished_at, job.cancel_requested, job.not_before = status, now, False, None
        record_event(session, job, "status", now)
        queue_webhooks(session, job.design, event, now)
        outcome, seconds = (job.problem or {}).get("code", event), (now - (job.started_at or now)).total_seconds()
        StepStatRepository(session).add({kind_of(DESIGN, outcome, seconds): Ended(1, seconds)})

    def _file_row(self, design_id: str, path: str, sha256: str) -> DesignFileRow:
        size = self._artifacts.size(sha256)
        return DesignFileRow(design_id=design_id, path=path, sha256=sha256, size=size, media_type=media_type_of(path))

    def _pairs(self, query: Any) -> list[tuple[str, int]]:
        with self._database.read_sessions() as session:
            return [(design_id, attempt) for design_id, attempt in session.execute(query)]

    @contextmanager
    def _attempt(self, design_id: str, attempt: int, statuses: tuple[str, ...]) -> Iterator[tuple[Session, JobRow | None]]:
        """A write transaction with the job, locked, or None where it is not in this attempt and one of these statuses."""
        with self._database.write_sessions.begin() as session:
            job = session.scalar(select(JobRow).where(JobRow.id == design_id).with_for_update(of=JobRow))
            matches = job is not None and job.attempt == attempt and job.status in statuses
            yield session, job if matches else None


def open_design_jobs(settings: Settings) -> StoredDesignJobs:
    """The queue of the database that the settings name."""
    return StoredDesignJobs(Database(settings.resolved_database_url), open_artifacts(settings.resolved_storage_url))
