import os
import signal
import subprocess
import sys
import time

import httpx
import psutil
import pytest

COMMAND = [sys.executable, "-m", "gripwright.cli", "serve", "--port", "0"]


@pytest.fixture
def environment(tmp_path):
    return {**os.environ, "GRIPWRIGHT_DATA": str(tmp_path / "data"), "GRIPWRIGHT_WORKERS": "1"}


def test_the_service_says_where_it_listens_and_ends_cleanly_with_all_its_processes(environment):
    service = subprocess.Popen(COMMAND, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        address = service.stdout.readline().strip().removeprefix("Gripwright listens on ")
        assert httpx.get(f"{address}/health/live", timeout=30).json() == {"status": "ok"}
        assert len(httpx.get(f"{address}/api/v1/actuators", timeout=30).json()["items"]) >= 85
        children = psutil.Process(service.pid).children(recursive=True)
        assert children

        service.send_signal(signal.SIGTERM)
        _, errors = service.communicate(timeout=30)
    finally:
        service.kill()

    assert service.returncode == 0, errors
    deadline = time.monotonic() + 5
    while any(child.is_running() and child.status() != psutil.STATUS_ZOMBIE for child in children):
        assert time.monotonic() < deadline, "a process of the service lives on"
        time.sleep(0.1)


@pytest.mark.parametrize("command", [COMMAND, [sys.executable, "-m", "gripwright.cli", "worker"]], ids=["serve", "worker"])
def test_a_database_of_ones_own_is_not_migrated_behind_ones_back(command, environment, tmp_path):
    environment["GRIPWRIGHT_DATABASE_URL"] = f"sqlite:///{tmp_path / 'own.db'}"

    refused = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    migrate = [sys.executable, "-m", "gripwright.cli", "migrate"]
    migrated = subprocess.run(migrate, env=environment, capture_output=True, text=True, timeout=60, check=False)

    assert refused.returncode == 1
    said = refused.stderr.strip()
    assert said.startswith("the database is at migration none, this version needs ")
    assert said.endswith("run `gripwright migrate`")
    assert "Traceback" not in refused.stderr
    assert migrated.returncode == 0, migrated.stderr


def test_the_openapi_command_prints_the_committed_document(environment):
    command = [sys.executable, "-m", "gripwright.cli", "openapi"]

    printed = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=True).stdout

    with open(os.path.join(os.path.dirname(__file__), "..", "..", "openapi", "openapi.json")) as file:
        assert printed == file.read()
