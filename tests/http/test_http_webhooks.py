import base64
import hashlib
import hmac
import json
import threading
from datetime import timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from gripwright.jobs.deliveries import DeliveryLoop, check_target
from gripwright.store.columns import utc_now


@pytest.fixture
def receiver():
    """A real server that keeps what it is sent and answers with `answer`."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["content-length"]))
            server.received.append((dict(self.headers), body))
            self.send_response(server.answer)
            self.end_headers()

        def log_message(self, *args):
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    server.received, server.answer = [], 204
    server.url = f"http://127.0.0.1:{server.server_port}/hook"
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield server
    server.shutdown()
    server.server_close()


@pytest.fixture
def loop(service, client):
    loop = DeliveryLoop(service.settings)
    while loop.deliver_next(utc_now() + timedelta(days=1)):  # what other tests left
        pass
    return loop


def subscribe(client, url, **fields):
    return client.post("/api/v1/webhooks", json={"url": url, **fields})


def test_a_subscriber_is_told_once_with_a_signature_that_verifies(client, design_id, finish, receiver, loop):
    webhook = subscribe(client, receiver.url).json()
    finish(design_id)

    while loop.deliver_next(utc_now()):
        pass

    ((headers, body),) = receiver.received
    key = base64.b64decode(webhook["secret"].removeprefix("whsec_"))
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    expected = base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()
    assert headers["webhook-signature"] == f"v1,{expected}"
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


@pytest.mark.parametrize("host", ["127.0.0.1", "10.0.0.1", "[::1]", "169.254.169.254", "localhost", "0.0.0.0"])
def test_private_targets_are_refused_unless_allowed(host):
    from gripwright.domain.errors import InvalidInput

    with pytest.raises(InvalidInput):
        check_target(f"http://{host}/hook", allow_private=False)
