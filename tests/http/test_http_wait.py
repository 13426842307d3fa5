import threading
import time

import pytest

from gripwright.http.preferences import Preferences, preferences

API = "/api/v1"


@pytest.mark.parametrize(
    ("headers", "wanted"),
    [
        ([], Preferences(None, False)),
        (["wait=10"], Preferences(10, False)),
        (["respond-async, wait=10"], Preferences(10, True)),
        (["Respond-Async; x=y", 'WAIT = "7"', "wait=9"], Preferences(7, True)),
        (["wait=-1"], Preferences(None, False)),
        (["wait=1e3, wait"], Preferences(None, False)),
        (["wait=9999999999"], Preferences(None, False)),
        (["wait=²"], Preferences(None, False)),
    ],
)
def test_preferences_are_read_as_rfc_7240_says(headers, wanted):
    assert preferences(headers) == wanted


@pytest.fixture
def finish_later(client, finish, product_id):
    """Ends the newest queued design of the product after a moment."""
    threads = []

    def later(after_s=0.4):
        def run():
            deadline = time.monotonic() + 20
            while not (items := client.get(f"{API}/products/{product_id}/designs?status=queued").json()["items"]):
                assert time.monotonic() < deadline
                time.sleep(0.02)
            time.sleep(after_s)
            finish(items[0]["id"])

        threads.append(threading.Thread(target=run))
        threads[-1].start()

    yield later
    for thread in threads:
        thread.join()


def test_a_request_that_waits_is_answered_with_the_design_as_soon_as_it_has_ended(client, product_id, finish_later):
    finish_later()

    began = time.monotonic()
    answer = client.post(f"{API}/products/{product_id}/designs", json={}, headers={"Prefer": "wait=20"})

    assert time.monotonic() - began < 15
    assert answer.status_code == 201, answer.text
    assert answer.headers["Preference-Applied"] == "wait=20"
    assert answer.headers["Location"] == f"{API}/designs/{answer.json()['id']}"
    assert "Retry-After" not in answer.headers
    assert answer.json()["design"]["status"] == "complete"
    assert client.get(answer.headers["Location"]).json() == answer.json()


def test_a_request_that_waits_in_vain_is_answered_as_one_that_does_not(client, product_id):
    url = f"{API}/products/{product_id}/designs"

    answer = client.post(url, json={}, headers={"Prefer": "respond-async, wait=1"})

    assert answer.status_code == 202
    assert answer.headers["Preference-Applied"] == "respond-async, wait=1"
    assert answer.headers["Retry-After"] == "1"
    assert answer.json()["status"] == "queued"
    assert client.post(url, json={}, headers={"Prefer": "respond-async"}).headers["Preference-Applied"] == "respond-async"


def test_waiting_again_under_the_same_key_gives_the_same_design(client, product_id, finish):
    url, headers = f"{API}/products/{product_id}/designs", {"Idempotency-Key": f"wait-{product_id}", "Prefer": "wait=0"}
    first = client.post(url, json={}, headers=headers)
    finish(first.json()["id"])

    again = client.post(url, json={}, headers=headers)

    assert (first.status_code, again.status_code) == (202, 201)
    assert again.json()["id"] == first.json()["id"]


@pytest.mark.parametrize("path", ["designs", "jobs"])
def test_a_read_that_waits_is_answered_as_soon_as_the_job_has_ended(client, design_id, finish_later, path):
    finish_later()

    answer = client.get(f"{API}/{path}/{design_id}", headers={"Prefer": "wait=20"})

    assert answer.json()["status"] in ("complete", "succeeded")
    assert answer.headers["Preference-Applied"] == "wait=20"


def test_nobody_is_granted_more_than_is_allowed(client, design_id, finish_later, service):
    finish_later()

    answer = client.get(f"{API}/designs/{design_id}", headers={"Prefer": "wait=3000"})

    assert answer.headers["Preference-Applied"] == f"wait={service.settings.wait_max_s}"


def test_faults_are_answered_at_once(client, product_id, problem):
    began = time.monotonic()

    problem(client.get(f"{API}/jobs/none", headers={"Prefer": "wait=20"}), 404)
    problem(client.post(f"{API}/products/none/designs", json={}, headers={"Prefer": "wait=1"}), 404)
    answer = client.post(f"{API}/products/{product_id}/designs", json={"x": 1}, headers={"Prefer": "wait=1"})

    problem(answer, 422)
    assert "Preference-Applied" not in answer.headers
    assert time.monotonic() - began < 15


def test_those_who_find_no_seat_are_answered_at_once_and_many_may_wait_beside_each_other(client, design_id, service, finish):
    url, answers = f"{API}/jobs/{design_id}", []

    def read():
        answers.append(client.get(url, headers={"Prefer": "wait=20"}).headers.get("Preference-Applied"))

    threads = [threading.Thread(target=read) for _ in range(service.settings.wait_requests + 3)]
    for thread in threads:
        thread.start()
    deadline = time.monotonic() + 15
    while len(answers) < 3 and time.monotonic() < deadline:
        time.sleep(0.05)
    finish(design_id)
    for thread in threads:
        thread.join()

    assert answers[:3] == [None] * 3
    assert answers[3:] == ["wait=20"] * service.settings.wait_requests
