import base64
import hashlib
import hmac
import json
import re
import time
from datetime import timedelta
from pathlib import Path

import pytest

from gripwright.jobs.deliveries import DeliveryLoop, pause_after
from gripwright.store.columns import utc_now
from webhook_receiver import receiving


@pytest.fixture
def receiver():
    with receiving() as server:
        yield server


@pytest.fixture
def loop(service, client):
    for left in client.get("/api/v1/webhooks").json()["items"]:  # by other tests
        client.delete(f"/api/v1/webhooks/{left['id']}")
    loop = DeliveryLoop(service.settings)
    assert not loop.deliver_next(utc_now() + timedelta(days=1))
    return loop


def subscribe(client, url, **fields):
    return client.post("/api/v1/webhooks", json={"url": url, **fields})


@pytest.fixture(scope="module")
def is_genuine():
    """The function that the documentation gives to receivers."""
    page = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    names = {}
    exec(code, names)
    return names["is_genuine"]


def test_a_subscriber_is_told_once_with_a_signature_that_verifies(client, design_id, finish, receiver, loop, is_genuine):
    webhook = subscribe(client, receiver.url).json()
    finish(design_id)

    while loop.deliver_next(utc_now()):
        pass

    ((headers, body),) = receiver.received
    key = base64.b64decode(webhook["secret"].removeprefix("whsec_"))
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    expected = base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()
    assert headers["webhook-signature"] == f"v1,{expected}"
    assert is_genuine(headers, body, webhook["secret"])
    assert not is_genuine(headers, body + b" ", webhook["secret"])
    assert not is_genuine({**headers, "webhook-timestamp": "1"}, body, webhook["secret"])
    assert json.loads(body)["type"] == "design.complete"
    assert json.loads(body)["data"]["design_id"] == design_id
    client.delete(f"/api/v1/webhooks/{webhook['id']}")


def test_a_message_that_is_not_taken_is_sent_again_later_with_the_same_id(client, design_id, jobs, receiver, loop):
    webhook = subscribe(client, receiver.url, events=["design.failed"]).json()
    receiver.answer = 500
    jobs.start(design_id, 1)
    jobs.fail(design_id, 1, {"detail": "no"})

    assert loop.deliver_next(utc_now())
    assert not loop.deliver_next(utc_now())
    receiver.answer = 200
    assert loop.deliver_next(utc_now() + timedelta(minutes=5))

    ids = [headers["webhook-id"] for headers, _ in receiver.received]
    assert len(ids) == 2
    assert len(set(ids)) == 1
    (delivery,) = client.get(f"/api/v1/webhooks/{webhook['id']}").json()["deliveries"]
    assert (delivery["status"], delivery["attempts"]) == ("delivered", 2)
    client.delete(f"/api/v1/webhooks/{webhook['id']}")


def test_a_secret_is_shown_once_and_a_deleted_webhook_is_gone(client, receiver, problem):
    created = subscribe(client, receiver.url)

    assert created.status_code == 201
    read = client.get(created.headers["Location"])
    assert "secret" not in read.json()
    assert client.delete(created.headers["Location"]).status_code == 204
    problem(client.get(created.headers["Location"]), 404)
    problem(client.delete(created.headers["Location"]), 404)


@pytest.mark.parametrize("fields", [{"url": "ftp://x"}, {"url": "no url"}, {"url": "http://127.0.0.1/", "events": ["x"]}])
def test_webhooks_that_cannot_be_are_refused(client, problem, fields):
    problem(client.post("/api/v1/webhooks", json=fields), 422)


@pytest.fixture
def webhook(client, receiver, loop):
    """A webhook with a test message that waits; `get` reads it, `post` acts on it."""
    made = subscribe(client, receiver.url).json()
    path = f"/api/v1/webhooks/{made['id']}"

    class Webhook:
        secret = made["secret"]
        get = staticmethod(lambda tail="", **query: client.get(path + tail, params=query))
        post = staticmethod(lambda tail, **body: client.post(path + tail, json=body))
        patch = staticmethod(lambda **body: client.patch(path, json=body))
        message = client.post(f"{path}/test").json()["id"]

    yield Webhook
    client.delete(path)


def verified(secret, headers, body):
    """Whether one of the signatures was made with this secret."""
    key = base64.b64decode(secret.removeprefix("whsec_"))
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    expected = base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()
    return f"v1,{expected}" in headers["webhook-signature"].split(" ")


def test_each_attempt_is_kept_with_what_came_back(webhook, receiver, loop):
    receiver.answer, receiver.body = 500, b"database\x1b is down " + b"x" * 5000
    loop.deliver_next(utc_now())
    receiver.answer, receiver.body = 204, b""
    loop.deliver_next(utc_now() + timedelta(minutes=5))

    delivery = webhook.get(f"/deliveries/{webhook.message}").json()

    failed, accepted = delivery["log"]
    assert (failed["status_code"], failed["error"], accepted["status_code"], accepted["error"]) == (500, "answered 500", 204, "")
    assert failed["response"].startswith("database? is down x")
    assert len(failed["response"]) == 1024
    assert failed["duration_s"] > 0
    assert json.loads(delivery["payload"])["type"] == "webhook.test"
    assert delivery["status"] == "delivered"


def test_deliveries_come_in_pages_and_by_status_and_webhooks_in_a_list(client, webhook, receiver, loop):
    loop.deliver_next(utc_now())
    waiting = [webhook.post("/test").json()["id"] for _ in range(3)]

    first = webhook.get("/deliveries", limit=3).json()
    rest = webhook.get("/deliveries", limit=3, cursor=first["next_cursor"]).json()

    assert [item["id"] for item in first["items"]] == waiting[::-1]
    assert [item["id"] for item in rest["items"]] == [webhook.message]
    assert rest["next_cursor"] is None
    assert [item["id"] for item in webhook.get("/deliveries", status="delivered").json()["items"]] == [webhook.message]
    listed = client.get("/api/v1/webhooks").json()
    assert webhook.get().json()["id"] in [item["id"] for item in listed["items"]]
    assert "whsec_" not in str(listed) + webhook.get().text


def test_a_message_is_sent_again_on_request_under_its_id(webhook, receiver, loop):
    loop.deliver_next(utc_now())

    assert webhook.post(f"/deliveries/{webhook.message}/redeliver").status_code == 202
    loop.deliver_next(utc_now())

    assert [headers["webhook-id"] for headers, _ in receiver.received] == [webhook.message] * 2
    assert len(webhook.get(f"/deliveries/{webhook.message}").json()["log"]) == 2


def test_both_secrets_sign_until_the_old_one_expires(webhook, receiver, loop):
    new = webhook.post("/rotate-secret", overlap_s=3600).json()["secret"]
    webhook.post("/test")

    loop.deliver_next(utc_now())
    loop.deliver_next(utc_now() + timedelta(hours=2))

    during, after = receiver.received
    assert [verified(secret, *during) for secret in (webhook.secret, new)] == [True, True]
    assert [verified(secret, *after) for secret in (webhook.secret, new)] == [False, True]


@pytest.mark.parametrize(("answer", "asked_s"), [(429, "120"), (503, "120"), (503, None)])
def test_a_receiver_that_asks_for_a_pause_gets_it_for_all_messages(webhook, receiver, loop, answer, asked_s):
    webhook.post("/test")
    receiver.answer, receiver.headers = answer, {} if asked_s is None else {"Retry-After": asked_s}
    now = utc_now()

    loop.deliver_next(now)

    assert loop.deliver_next(now + timedelta(seconds=100)) is (asked_s is None)
    assert loop.deliver_next(now + timedelta(seconds=150))


def test_a_receiver_that_is_gone_is_asked_no_more_until_it_is_enabled_again(webhook, receiver, loop, problem):
    webhook.post("/test")
    receiver.answer = 410

    loop.deliver_next(utc_now())

    assert not loop.deliver_next(utc_now() + timedelta(days=1))
    seen = webhook.get().json()
    assert (seen["enabled"], seen["disabled_reason"]) == (False, "its receiver answered 410 Gone")
    problem(webhook.post("/test"), 409)
    problem(webhook.post(f"/deliveries/{webhook.message}/redeliver"), 409)
    receiver.answer = 204
    assert webhook.patch(enabled=True).json()["disabled_reason"] == ""
    assert loop.deliver_next(utc_now())


def test_a_webhook_that_has_failed_for_days_is_disabled_and_says_why(webhook, receiver, loop):
    receiver.answer = 500
    loop.deliver_next(utc_now())

    loop.deliver_next(utc_now() + timedelta(days=6))

    assert "at last: answered 500" in webhook.get().json()["disabled_reason"]


def test_a_change_is_checked_as_a_new_webhook_is(webhook, problem):
    problem(webhook.patch(url="ftp://x"), 422)
    problem(webhook.patch(url="http://ada:secret@127.0.0.1/"), 422)
    problem(webhook.patch(events=None), 422)

    assert webhook.patch(events=["design.failed"]).json()["events"] == ["design.failed"]


def test_messages_that_are_over_are_removed_in_time_and_others_stay(webhook, receiver, loop):
    loop.deliver_next(utc_now())
    waiting = webhook.post("/test").json()["id"]

    loop.clear(utc_now() + timedelta(days=31))

    assert [item["id"] for item in webhook.get("/deliveries").json()["items"]] == [waiting]


def test_a_slow_receiver_gets_one_message_at_a_time_and_delays_no_other(client, service, loop, receiver, webhook):
    loop.deliver_next(utc_now())
    with receiving() as slow:
        slow.delay_s = 2.0
        path = subscribe(client, slow.url).headers["Location"]
        for _ in range(3):
            client.post(f"{path}/test")
        webhook.post("/test")
        loop.start()
        deadline = time.monotonic() + 10
        while len(receiver.received) < 2:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        sent_meanwhile = len(slow.received)
        loop.stop()
        client.delete(path)

    assert sent_meanwhile <= 1
    assert slow.most_at_once == 1


def test_pauses_grow_and_are_not_all_alike():
    pauses = [pause_after(attempts).total_seconds() for attempts in range(1, 8)]

    assert pauses == sorted(pauses)
    assert all(least <= pause <= 1.2 * least for least, pause in zip([5, 30, 120, 600, 1800, 7200, 21600], pauses, strict=True))
    assert len({pause_after(3) for _ in range(20)}) > 1
