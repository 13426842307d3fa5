import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest

from gripwright.domain.errors import Conflict
from gripwright.store.claims import DesignLimits
from gripwright.store.columns import new_id, utc_now
from gripwright.store.designs import DesignRepository, JobRepository, JobTerms
from gripwright.store.events import EventRepository
from gripwright.store.jobs import PAUSES_S, StoredDesignJobs
from gripwright.store.models import DesignRow, JobRow, WebhookDeliveryRow, WebhookRow
from gripwright.store.webhooks import WebhookRepository
from service_factory import store_product


@pytest.fixture
def queue(database, artifacts):
    """Queues a design; its id."""
    product_id = store_product(database, artifacts)

    def queue(**terms):
        now = utc_now()
        design = DesignRow(
            id=new_id(now),
            product_id=product_id,
            product_version=1,
            task_sha256="0" * 64,
            actuators_sha256="1" * 64,
            options={"seed": 3},
            outcome=None,
            created_at=now,
        )
        with database.write_sessions.begin() as session:
            DesignRepository(session).add(design, now, JobTerms(**terms))
        return design.id

    return queue


def job_of(database, design_id):
    with database.read_sessions() as session:
        return JobRepository(session).get(design_id)


def kinds_of(database, design_id):
    with database.read_sessions() as session:
        return [(event.kind, event.data["status"]) for event in EventRepository(session).after(design_id, 0, 100)]


def take(jobs, worker="w-0", **limits):
    return [design_id for design_id, _ in jobs.claim(worker, DesignLimits(**limits))]


def test_what_was_queued_waits_in_order_until_a_worker_takes_it(queue, jobs):
    ids = [queue() for _ in range(3)]

    assert [design_id for design_id, _ in jobs.undispatched(2)] == ids[:2]
    assert take(jobs, per_worker=1) == ids[:1]
    assert jobs.undispatched(10) == [(ids[1], 1), (ids[2], 1)]
    assert jobs.watched() == [(ids[0], 1, "queued", False)]


def test_a_worker_takes_no_more_than_it_may_run(queue, jobs):
    ids = [queue() for _ in range(5)]
    assert take(jobs, per_worker=2) == ids[:2]
    jobs.start(ids[0], 1, "w-0")

    assert take(jobs, per_worker=2) == []
    assert take(jobs, worker="w-1", per_worker=2) == ids[2:4]
    jobs.fail(ids[0], 1, {"detail": "no"})
    assert take(jobs, per_worker=2) == ids[4:]


def test_the_most_urgent_goes_first_then_whoever_has_fewest_running_then_the_oldest(queue, jobs):
    old = [queue(client="key:a") for _ in range(2)]
    late = queue(client="key:b")
    urgent = queue(client="key:a", priority=9)
    unhurried = queue(client="key:c", priority=0)

    assert take(jobs, per_worker=10) == [urgent, late, *old, unhurried]


def test_a_job_that_waits_can_be_made_more_urgent_and_one_that_runs_cannot(queue, jobs, database):
    first, second = queue(), queue()
    with database.write_sessions.begin() as session:
        JobRepository(session).prioritise(JobRepository(session).get(second), 7, utc_now())

    assert take(jobs, per_worker=1) == [second]
    jobs.start(second, 1, "w-0")

    with pytest.raises(Conflict, match="running"), database.write_sessions.begin() as session:
        JobRepository(session).prioritise(JobRepository(session).get(second), 1, utc_now())
    assert job_of(database, first).priority == 5


def test_a_client_runs_no_more_than_it_may_however_many_workers_ask_at_once(queue, database, artifacts):
    clients = {queue(client=name): name for name in ("key:a", "key:b") for _ in range(20)}
    everybody = [StoredDesignJobs(database, artifacts) for _ in range(8)]
    gate = threading.Barrier(len(everybody))

    def ask(number):
        gate.wait()
        return take(everybody[number], worker=f"w-{number}", per_worker=4, per_client=3)

    with ThreadPoolExecutor(len(everybody)) as pool:
        taken = [design_id for part in pool.map(ask, range(len(everybody))) for design_id in part]

    assert Counter(clients[design_id] for design_id in taken) == {"key:a": 3, "key:b": 3}
    assert len(set(taken)) == 6


def test_a_job_is_put_back_with_growing_pauses_and_fails_at_last(queue, jobs, database):
    design_id = queue()
    pauses = []
    for attempt in range(1, len(PAUSES_S) + 1):
        assert jobs.start(design_id, attempt)
        jobs.put_back(design_id, attempt, {"code": "step-failure", "detail": "no space left"})
        job = job_of(database, design_id)
        pauses.append((job.not_before - utc_now()).total_seconds())
        assert (job.status, job.attempt, job.dispatched) == ("queued", attempt + 1, False)
        assert jobs.undispatched(10) == []

    assert pauses == pytest.approx(PAUSES_S, abs=0.5)
    assert jobs.start(design_id, 6)
    jobs.put_back(design_id, 6, {"code": "step-failure", "detail": "no space left"})
    job = job_of(database, design_id)
    assert (job.status, job.problem["detail"]) == ("failed", "no space left (tried 6 times)")
    with database.write_sessions.begin() as session:
        JobRepository(session).retry(JobRepository(session).get(design_id), utc_now())
    assert jobs.undispatched(10) == [(design_id, 7)]


def test_a_job_past_its_deadline_is_told_to_stop_and_found(queue, jobs):
    early, late, none = queue(deadline_s=600.0), queue(deadline_s=-1.0), queue()

    assert [jobs.stop_reason(design_id, 1) for design_id in (early, late, none)] == [None, "deadline-exceeded", None]
    assert jobs.watched() == [(late, 1, "queued", True)]
    jobs.fail(late, 1, {"code": "deadline-exceeded", "detail": "late"})
    assert jobs.watched() == []


def test_a_step_in_quarantine_is_released_by_the_retry_of_a_job_that_failed_in_it(queue, jobs, database):
    key, design_id = "a" * 64, queue()
    for _ in range(2):
        jobs.quarantine(key, stage="fit", plugin="fitter/x", detail="crashed")
    jobs.start(design_id, 1)
    jobs.fail(design_id, 1, {"code": "step-failure", "detail": "crashed"}, step=key)
    assert (jobs.quarantined(key).times, jobs.quarantined(key).plugin) == (2, "fitter/x")

    with database.write_sessions.begin() as session:
        JobRepository(session).retry(JobRepository(session).get(design_id), utc_now())

    assert jobs.quarantined(key) is None


def test_a_snapshot_is_what_was_requested(queue, jobs):
    snapshot = jobs.snapshot(queue())

    assert (snapshot.task_sha256, snapshot.actuators_sha256, snapshot.options) == ("0" * 64, "1" * 64, {"seed": 3})


def test_a_job_starts_once_and_a_recovery_may_start_it_again(queue, jobs, database):
    design_id = queue()

    assert jobs.start(design_id, 1)
    started_at = job_of(database, design_id).started_at
    assert jobs.start(design_id, 1)
    assert job_of(database, design_id).started_at == started_at
    assert not jobs.start(design_id, 2)
    assert jobs.watched() == [(design_id, 1, "running", False)]


def test_a_job_ends_exactly_once(queue, jobs, database, artifacts):
    design_id = queue()
    jobs.start(design_id, 1)

    jobs.finish(design_id, 1, "complete", {"status": "complete"}, {"bom.csv": artifacts.put(b"a\n")})
    jobs.fail(design_id, 1, {"detail": "too late"})
    jobs.cancelled(design_id, 1)
    jobs.finish(design_id, 1, "incomplete", {}, {})

    job = job_of(database, design_id)
    assert (job.status, job.problem, job.fraction) == ("succeeded", None, 1.0)
    assert kinds_of(database, design_id) == [("status", "queued"), ("status", "running"), ("status", "succeeded")]
    with database.read_sessions() as session:
        design = DesignRepository(session).get(design_id)
        assert (design.outcome, [file.path for file in design.files]) == ("complete", ["bom.csv", "design.json"])


def test_what_an_old_attempt_says_changes_nothing(queue, jobs, database):
    design_id = queue()
    jobs.start(design_id, 1)
    jobs.fail(design_id, 1, {"detail": "crash"})
    with database.write_sessions.begin() as session:
        repository = JobRepository(session)
        repository.retry(repository.get(design_id), utc_now())
    assert jobs.start(design_id, 2)

    jobs.fail(design_id, 1, {"detail": "late"})
    jobs.record_progress(design_id, 1, 0.9, "fit", "late")

    job = job_of(database, design_id)
    assert (job.status, job.attempt, job.problem, job.fraction) == ("running", 2, None, 0.0)


def test_progress_never_goes_back(queue, jobs, database):
    design_id = queue()
    jobs.start(design_id, 1)

    jobs.record_progress(design_id, 1, 0.5, "fit", "")
    jobs.record_progress(design_id, 1, 0.3, "fit", "another step")

    assert job_of(database, design_id).fraction == 0.5


def test_a_job_that_is_gone_counts_as_cancelled(jobs):
    assert jobs.stop_reason("none", 1) == "cancelled"
    assert not jobs.start("none", 1)


def test_the_end_of_a_job_queues_a_message_to_those_who_asked_for_it(queue, jobs, database):
    now = utc_now()
    with database.write_sessions.begin() as session:
        for name, events in (("all", ["design.failed", "design.complete"]), ("other", ["design.complete"])):
            row = WebhookRow(
                id=name, url="http://x", events=events, secret="whsec_", enabled=True, disabled_reason="", created_at=now
            )
            WebhookRepository(session).add(row)
    design_id = queue()

    jobs.start(design_id, 1)
    jobs.fail(design_id, 1, {"detail": "no"})

    with database.read_sessions() as session:
        messages = session.query(WebhookDeliveryRow).all()
    assert [(message.webhook_id, message.status) for message in messages] == [("all", "pending")]


def test_the_history_of_what_ended_long_ago_is_forgotten_and_of_nothing_else(queue, jobs, database):
    old, recent, running = queue(), queue(), queue()
    for design_id in (old, recent, running):
        jobs.start(design_id, 1)
    for design_id in (old, recent):
        jobs.fail(design_id, 1, {"detail": "no"})
    jobs.quarantine("a" * 64, stage="fit", plugin=None, detail="crashed")
    with database.write_sessions.begin() as session:
        session.get(JobRow, old).finished_at = utc_now() - timedelta(days=8)

    jobs.forget(7)

    assert [len(kinds_of(database, design_id)) for design_id in (old, recent, running)] == [0, 3, 2]
    assert jobs.quarantined("a" * 64).times == 1


def test_times_come_back_with_their_zone_and_naive_ones_are_refused(queue, database):
    job = job_of(database, queue())

    assert job.created_at.utcoffset() == timedelta(0)
    assert abs(utc_now() - job.created_at) < timedelta(minutes=1)
    with pytest.raises(Exception, match="without a zone"), database.write_sessions.begin() as session:
        JobRepository(session).get(job.id).started_at = utc_now().replace(tzinfo=None)
