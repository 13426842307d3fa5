"""Keys at the command line, and a start that is refused without one."""

import json
import os
import re
import signal
import subprocess
import sys

import httpx
import pytest

GRIPWRIGHT = [sys.executable, "-m", "gripwright.cli"]
START_S = 60


@pytest.fixture
def environment(tmp_path):
    return {**os.environ, "GRIPWRIGHT_DATA": str(tmp_path / "data"), "GRIPWRIGHT_WORKERS": "0"}


@pytest.fixture
def run(environment):
    def run(*arguments):
        command = [*GRIPWRIGHT, *arguments]
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=START_S, check=False)

    return run


@pytest.fixture
def served(environment):
    """Starts a service on every address; its address on this machine."""
    started = []

    def serve():
        command = [*GRIPWRIGHT, "serve", "--host", "0.0.0.0", "--port", "0"]
        service = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        started.append(service)
        return service.stdout.readline().strip().removeprefix("Gripwright listens on ").replace("0.0.0.0", "127.0.0.1")

    yield serve
    for service in started:
        service.send_signal(signal.SIGTERM)
        service.communicate(timeout=30)


def test_a_key_opens_a_service_that_others_can_reach_until_it_is_revoked(run, served):
    refused = run("serve", "--host", "0.0.0.0", "--port", "0")
    assert refused.returncode == 1
    assert "gripwright keys create" in refused.stderr.splitlines()[-1]
    assert "Traceback" not in refused.stderr

    made = run("keys", "create", "PLM", "--scope", "admin", "--days", "30")
    key = made.stdout.strip()
    assert re.fullmatch(r"gwk_[0-9a-f]{32}_[\w-]{43}", key)
    address = served()

    def status(word):
        return httpx.get(f"{address}/api/v1/jobs", headers={"Authorization": f"Bearer {word}"}, timeout=START_S).status_code

    unsigned = httpx.get(f"{address}/api/v1/jobs", timeout=START_S)
    assert unsigned.status_code == 401
    assert "server" not in unsigned.headers, "what the service is made with is nobody's business"
    assert status(key) == 200
    newer = run("keys", "rotate", "PLM", "--overlap", "1").stdout.strip()
    assert (status(key), status(newer)) == (200, 200)
    assert run("keys", "revoke", key.split("_")[1]).returncode == 0
    assert (status(key), status(newer)) == (401, 200)
    last = run("keys", "rotate", "PLM", "--overlap", "0").stdout.strip()
    assert (status(newer), status(last)) == (401, 200)

    listed = run("keys", "list").stdout
    assert [line.split("  ")[1:3] for line in listed.splitlines()] == [["PLM", "admin"]] * 3
    assert [word for word in ("revoked", "expired", "valid until") if word in listed] == ["revoked", "expired", "valid until"]
    assert not [word for word in (key, newer, last) if word in listed or word.split("_", 2)[2] in listed]

    lines = [json.loads(line) for line in run("audit", "--json", "--limit", "100").stdout.splitlines()]
    assert [line["path"] for line in lines if line["method"] == "CLI"] == [
        "keys rotate PLM",
        "keys revoke PLM",
        "keys rotate PLM",
        "keys create PLM",
    ]
    assert [line["status"] for line in lines if line["method"] == "GET"] == [401, 401, 401]
    assert all(line["actor"].startswith("cli:") for line in lines if line["method"] == "CLI")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("keys", "rotate", "nobody"), "no valid key is nobody"),
        (("keys", "revoke", "nobody"), "no valid key is nobody"),
        (("keys", "create", " "), "a key's name has 1 to 100 printable characters"),
        (("keys", "create", "a\x1bb"), "a key's name has 1 to 100 printable characters"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason(run, arguments, reason):
    answer = run(*arguments)

    assert answer.returncode == 1
    assert answer.stderr.startswith(reason)
    assert answer.stdout == ""


def test_the_trail_is_a_line_for_each_row(run):
    run("keys", "create", "one")
    run("keys", "create", "two")

    (line,) = run("audit", "--limit", "1").stdout.splitlines()

    assert re.fullmatch(r"\S+Z  -  cli:\S+  -  CLI  keys create two  200  [0-9a-f]{32}", line)
