import json
import threading
import time
from datetime import datetime

import pytest


def events_of(text):
    """(id, kind, status) of each event of a stream."""
    blocks = [dict(line.partition(": ")[::2] for line in block.splitlines() if line) for block in text.split("\n\n")]
    return [(int(block["id"]), block["event"]) for block in blocks if "event" in block]


def test_jobs_are_listed_the_newest_first_and_by_status(client, product_id):
    ids = [client.post(f"/api/v1/products/{product_id}/designs", json={}).json()["id"] for _ in range(3)]
    client.post(f"/api/v1/jobs/{ids[1]}/cancel")

    newest = client.get("/api/v1/jobs", params={"product_id": product_id, "limit": 2})
    queued = client.get("/api/v1/jobs", params={"product_id": product_id, "status": "queued"})

    assert [job["id"] for job in newest.json()["items"]] == [ids[2], ids[1]]
    assert [job["id"] for job in client.get(newest.links["next"]["url"]).json()["items"]] == [ids[0]]
    assert [job["id"] for job in queued.json()["items"]] == [ids[2], ids[0]]


def test_a_queued_job_is_cancelled_at_once_and_can_be_retried(client, design_id, jobs, problem):
    assert client.post(f"/api/v1/jobs/{design_id}/cancel").json()["status"] == "cancelled"
    assert not jobs.start(design_id, 1)

    retried = client.post(f"/api/v1/jobs/{design_id}/retry")

    assert (retried.status_code, retried.json()["status"], retried.json()["attempt"]) == (202, "queued", 2)
    assert (design_id, 2) in jobs.undispatched(1000)
    problem(client.post(f"/api/v1/jobs/{design_id}/retry"), 409, "conflict")


def test_a_running_job_is_asked_to_stop(client, design_id, jobs, problem):
    jobs.start(design_id, 1)

    answer = client.post(f"/api/v1/jobs/{design_id}/cancel")

    assert (answer.json()["status"], answer.json()["cancel_requested"]) == ("running", True)
    assert jobs.stop_reason(design_id, 1) == "cancelled"
    jobs.cancelled(design_id, 1)
    assert client.get(f"/api/v1/jobs/{design_id}").json()["status"] == "cancelled"


def test_a_job_that_waits_takes_another_priority_and_one_that_runs_does_not(client, product_id, jobs, problem):
    made = client.post(f"/api/v1/products/{product_id}/designs", json={"priority": 2}).json()
    assert client.get(made["job"]).json()["priority"] == 2

    changed = client.patch(made["job"], json={"priority": 9}, headers={"Content-Type": "application/merge-patch+json"})

    assert (changed.status_code, changed.json()["priority"]) == (200, 9)
    for body in ({"priority": 10}, {"priority": -1}, {"priority": "high"}, {"status": "succeeded"}, {}):
        problem(client.patch(made["job"], json=body), 422)
    jobs.start(made["id"], 1)
    problem(client.patch(made["job"], json={"priority": 1}), 409, "conflict")


def test_a_design_has_the_deadline_that_was_asked_for_and_a_retry_a_new_one(client, product_id, jobs):
    made = client.post(f"/api/v1/products/{product_id}/designs", json={"deadline_s": 60}).json()
    before = client.get(made["job"]).json()
    client.post(made["job"] + "/cancel")
    after = client.post(made["job"] + "/retry").json()

    seconds = [
        (datetime.fromisoformat(job["deadline_at"]) - datetime.fromisoformat(job["created_at"])).total_seconds()
        for job in (before, after)
    ]
    assert seconds[0] == pytest.approx(60.0, abs=0.01)
    assert 60.0 < seconds[1] < 65.0


def test_a_finished_job_is_neither_cancelled_nor_retried(client, design_id, finish, problem):
    finish(design_id)

    problem(client.post(f"/api/v1/jobs/{design_id}/cancel"), 409, "conflict")
    problem(client.post(f"/api/v1/jobs/{design_id}/retry"), 409, "conflict")
    assert client.get(f"/api/v1/jobs/{design_id}").json()["outcome"] == "complete"


@pytest.mark.parametrize(
    ("method", "path"), [("GET", ""), ("PATCH", ""), ("POST", "/cancel"), ("POST", "/retry"), ("GET", "/events")]
)
def test_an_unknown_job_is_not_found(client, problem, method, path):
    problem(
        client.request(method, f"/api/v1/jobs/none{path}", json={"priority": 1} if method == "PATCH" else None), 404, "not-found"
    )


def test_events_tell_the_whole_story_and_end_with_the_job(client, design_id, jobs, finish):
    finish(design_id)

    answer = client.get(f"/api/v1/jobs/{design_id}/events")

    assert answer.headers["content-type"].startswith("text/event-stream")
    assert [kind for _, kind in events_of(answer.text)] == ["status", "status", "status"]
    assert '"status": "succeeded"' in answer.text


def test_the_log_of_a_job_says_how_long_each_step_took_and_how_it_ended(client, design_id, jobs):
    jobs.start(design_id, 1)
    jobs.record_step(design_id, 1, "fit", 1.25, "done")
    jobs.fail(design_id, 1, {"detail": "no"})
    jobs.record_step(design_id, 1, "fit", 9.0, "too late")

    text = client.get(f"/api/v1/jobs/{design_id}/events").text

    logged = [json.loads(line.removeprefix("data: ")) for line in text.splitlines() if '"log":' in line]
    assert [event["log"] for event in logged] == [{"stage": "fit", "seconds": 1.25, "message": "done"}]
    assert datetime.fromisoformat(logged[0]["at"]).utcoffset() is not None


def test_a_listener_that_comes_back_gets_what_it_missed_and_nothing_twice(client, design_id, jobs, finish):
    jobs.start(design_id, 1)
    for step in range(1, 4):
        jobs.record_progress(design_id, 1, step / 10, "fit", f"step {step}")
    jobs.fail(design_id, 1, {"detail": "no"})
    everything = events_of(client.get(f"/api/v1/jobs/{design_id}/events").text)

    seen = everything[2][0]
    missed = client.get(f"/api/v1/jobs/{design_id}/events", headers={"Last-Event-ID": str(seen)})

    assert events_of(missed.text) == everything[3:]
    assert len(everything) == 6


def test_events_arrive_while_the_job_runs(client, design_id, jobs):
    jobs.start(design_id, 1)
    arrived = []

    def listen():
        arrived.append(client.get(f"/api/v1/jobs/{design_id}/events").text)

    listener = threading.Thread(target=listen)
    listener.start()
    time.sleep(0.4)
    jobs.record_progress(design_id, 1, 0.5, "fit", "halfway")
    jobs.fail(design_id, 1, {"detail": "stopped"})
    listener.join(timeout=10)

    assert '"message": "halfway"' in arrived[0]


def test_a_bad_last_event_id_is_refused(client, design_id, problem):
    for last in ("x", "-1", str(2**63)):
        problem(client.get(f"/api/v1/jobs/{design_id}/events", headers={"Last-Event-ID": last}), 422)
