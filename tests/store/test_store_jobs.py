from datetime import timedelta

import pytest

from gripwright.store.columns import new_id, utc_now
from gripwright.store.designs import DesignRepository, JobRepository
from gripwright.store.events import EventRepository
from gripwright.store.models import DesignRow, WebhookDeliveryRow, WebhookRow
from gripwright.store.webhooks import WebhookRepository
from service_factory import store_product


@pytest.fixture
def queue(database, artifacts):
    """Queues a design; its id."""
    product_id = store_product(database, artifacts)

    def queue():
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
            DesignRepository(session).add(design, now)
        return design.id

    return queue


def job_of(database, design_id):
    with database.read_sessions() as session:
        return JobRepository(session).get(design_id)


def kinds_of(database, design_id):
    with database.read_sessions() as session:
        return [(event.kind, event.data["status"]) for event in EventRepository(session).after(design_id, 0, 100)]


def test_what_was_queued_waits_in_order_until_it_is_dispatched(queue, jobs):
    ids = [queue() for _ in range(3)]

    assert [design_id for design_id, _ in jobs.undispatched(2)] == ids[:2]
    jobs.mark_dispatched(ids[0], 1)
    assert jobs.undispatched(10) == [(ids[1], 1), (ids[2], 1)]


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
    assert jobs.running() == [(design_id, 1)]


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
    assert jobs.cancel_requested("none")
    assert not jobs.start("none", 1)


def test_the_end_of_a_job_queues_a_message_to_those_who_asked_for_it(queue, jobs, database):
    now = utc_now()
    with database.write_sessions.begin() as session:
        for name, events in (("all", ["design.failed", "design.complete"]), ("other", ["design.complete"])):
            row = WebhookRow(id=name, url="http://x", events=events, secret="whsec_", created_at=now)
            WebhookRepository(session).add(row)
    design_id = queue()

    jobs.start(design_id, 1)
    jobs.fail(design_id, 1, {"detail": "no"})

    with database.read_sessions() as session:
        messages = session.query(WebhookDeliveryRow).all()
    assert [(message.webhook_id, message.status) for message in messages] == [("all", "pending")]


def test_times_come_back_with_their_zone_and_naive_ones_are_refused(queue, database):
    job = job_of(database, queue())

    assert job.created_at.utcoffset() == timedelta(0)
    assert abs(utc_now() - job.created_at) < timedelta(minutes=1)
    with pytest.raises(Exception, match="without a zone"), database.write_sessions.begin() as session:
        JobRepository(session).get(job.id).started_at = utc_now().replace(tzinfo=None)
