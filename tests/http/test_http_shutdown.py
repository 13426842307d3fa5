"""The service as a process: how it ends, and what it tells its log."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from urllib.parse import urlsplit

import httpx
import pytest

from service_factory import make_document, make_package

COMMAND = [sys.executable, "-m", "gripwright.cli", "serve", "--port", "0"]


@contextlib.contextmanager
def serving(folder, **settings):
    environment = {**os.environ, "GRIPWRIGHT_DATA": str(folder), "GRIPWRIGHT_WORKERS": "0", **settings}
    service = subprocess.Popen(COMMAND, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield service, service.stdout.readline().strip().removeprefix("Gripwright listens on ")
    finally:
        service.kill()
        service.communicate()


class SlowUpload:
    """A product of which half has been sent."""

    def __init__(self, address, package):
        parts = urlsplit(address)
        self._connection = socket.create_connection((parts.hostname, parts.port), timeout=30)
        request = httpx.Request("POST", address, files={"package": ("product.zip", package)})
        body, kind = request.read(), request.headers["content-type"]
        head = f"POST /api/v1/products HTTP/1.1\r\nHost: {parts.netloc}\r\nContent-Type: {kind}\r\n"
        head += f"X-Request-ID: slow\r\nContent-Length: {len(body)}\r\n\r\n"
        self._connection.sendall(head.encode() + body[:300])
        self._rest = body[300:]

    def finish(self):
        """Send the rest; the first line of the answer."""
        self._connection.sendall(self._rest)
        return self._connection.makefile("rb").readline().decode().strip()


def test_told_to_end_it_ends_streams_answers_what_is_in_flight_and_takes_no_more(tmp_path):
    with serving(tmp_path) as (service, address), httpx.Client(base_url=address, timeout=60) as client:
        product = client.post("/api/v1/products", files={"package": ("product.zip", make_package(make_document()))})
        assert product.status_code == 201, product.text
        design = client.post(f"{product.headers['Location']}/designs", json={}).json()["id"]
        slow = SlowUpload(address, make_package(make_document()))
        with client.stream("GET", f"/api/v1/jobs/{design}/events") as stream:
            events = stream.iter_lines()
            assert next(events).startswith(("id:", "event:", "data:"))
            told_s = time.monotonic()
            service.send_signal(signal.SIGTERM)
            rest = list(events)
            streamed_s = time.monotonic() - told_s
        with pytest.raises(httpx.ConnectError):
            httpx.get(f"{address}/health/live")
        answered = slow.finish()
        _, log = service.communicate(timeout=30)

    assert service.returncode == 0, log
    assert streamed_s < 2.0
    assert not any('"succeeded"' in line for line in rest)
    assert answered == "HTTP/1.1 201 Created"
    (line,) = [line for line in map(json.loads, log.splitlines()) if line.get("request_id") == "slow"]
    assert (line["route"], line["status"], line["method"]) == ("/products", 201, "POST")


def test_a_request_that_does_not_end_is_given_up_at_the_limit_and_a_second_signal_waits_for_nothing(tmp_path):
    ended = {}
    for signals, settings in ((1, {"GRIPWRIGHT_SHUTDOWN_S": "1"}), (2, {"GRIPWRIGHT_SHUTDOWN_S": "60"})):
        with serving(tmp_path, **settings) as (service, address):
            httpx.get(f"{address}/health/live", timeout=30)
            upload = SlowUpload(address, make_package(make_document()))
            time.sleep(0.5)
            for _ in range(signals):
                service.send_signal(signal.SIGTERM)
                time.sleep(0.3)
            service.communicate(timeout=15)
            ended[signals] = service.returncode
            del upload

    assert ended == {1: 0, 2: 128 + signal.SIGTERM}


def test_each_request_is_one_line_whatever_callers_send_and_holds_no_secret(tmp_path):
    key = "gwk_0123456789abcdef_secretsecretsecret"
    forged = "/x%0A%7B%22event%22%3A%22forged%22%7D%1B[31m"
    with serving(tmp_path, GRIPWRIGHT_LOG_FORMAT="console") as (service, address):
        trace = f"00-{'ab' * 16}-{'cd' * 8}-01"
        httpx.get(address + forged, headers={"traceparent": trace, "x-request-id": "mine"}, timeout=30)
        httpx.get(f"{address}/api/v1/jobs?secret={key}", headers={"authorization": f"Bearer {key}"}, timeout=30)
        service.send_signal(signal.SIGTERM)
        _, log = service.communicate(timeout=30)

    (line,) = [line for line in log.splitlines() if "mine" in line]
    assert "ab" * 16 in line
    assert "status=404" in line
    assert not [line for line in log.splitlines() if line.startswith("{")]
    assert "\x1b" not in log
    assert "secretsecret" not in log
