"""Two hosts, a database and an S3 server on one network; the first host is cut off in the middle: everything ends, once.

`python tests/soak/two_hosts.py [DESIGNS]`, as root: hosts are network namespaces (iproute2), each with a PID namespace and a
host name of its own, so that neither sees the other's processes.
"""

import contextlib
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "jobs"))

from fake_calculation import executed
from service import Service, make_service

from gripwright.jobs.hosts import LOST
from postgresql_server import running_postgresql
from s3_server import running_s3
from soak._fleet import end_as_ctrl_c

BRIDGE, GATEWAY, LEASE_S = "gw-soak", "10.77.13.1", 10
HOSTS = {"gw-one": "10.77.13.11", "gw-two": "10.77.13.12"}
_PATIENCE_S = 600.0


def main(designs: int) -> int:
    with (
        _network(),
        running_postgresql(f"{GATEWAY}:5499") as server,
        running_s3(GATEWAY) as storage,
        tempfile.TemporaryDirectory(prefix="gripwright-soak-") as folder,
        pytest.MonkeyPatch.context() as monkeypatch,
    ):
        for name in ("data", "jobs"):
            server.create_database(name)
        for name, value in storage.environment.items():
            monkeypatch.setenv(name, value)
        service = make_service(
            Path(folder),
            monkeypatch,
            DATABASE_URL=server.network_url("data"),
            JOBS_DATABASE_URL=server.network_url("jobs"),
            STORAGE_URL=storage.create_bucket(),
            WORKER_LEASE_S=str(LEASE_S),
        )
        try:
            _run(service, designs)
        finally:
            service.stop()
    return 0


def _run(service: Service, designs: int) -> None:
    first = service.start_worker(*_on("gw-one"))
    ids = [service.request_design(f"a{number} b{number}:wait c{number}") for number in range(designs)]
    service.wait_for(lambda: _waiting(service), _PATIENCE_S)
    held = _waiting(service)
    service.start_worker(*_on("gw-two"))
    service.wait_for(lambda: len(_waiting(service)) > len(held), _PATIENCE_S)

    start_s = time.monotonic()
    _ip("link", "set", "gw-one", "down")
    print(f"the first host is cut off while it runs {held}", flush=True)
    code = first.wait(6 * LEASE_S)
    print(f"its worker ended itself with code {code} after {time.monotonic() - start_s:.0f} s", flush=True)
    assert code == LOST, code
    for number in range(designs):
        service.let_go(f"b{number}")
    service.wait_for(lambda: all(executed(service.log).count(step) == 2 for step in held), _PATIENCE_S)
    print(f"the second host runs them after {time.monotonic() - start_s:.0f} s", flush=True)
    _ip("link", "set", "gw-one", "up")
    service.start_worker(*_on("gw-one"))  # as whatever keeps workers alive would
    statuses = Counter(service.wait(design_id, seconds=_PATIENCE_S).status for design_id in ids)

    print(f"all have ended: {dict(statuses)}")
    assert statuses == {"succeeded": designs}, statuses
    for design_id in ids:
        ends = [event.data["status"] for event in service.events(design_id) if event.kind == "status"]
        assert ends == ["queued", "running", "succeeded"], ends
    print("each ended exactly once")


def _waiting(service: Service) -> list[str]:
    """The steps that have begun and wait to be let go."""
    return [line for line in executed(service.log) if line.startswith("begin:b")]


def _on(host: str) -> list[str]:
    separate = ["unshare", "--pid", "--fork", "--kill-child", "--mount-proc", "--uts"]
    return ["ip", "netns", "exec", host, *separate, "sh", "-c", f'hostname {host} && exec "$@"', "sh"]


@contextlib.contextmanager
def _network() -> Iterator[None]:
    """A bridge with one cable to each host."""
    try:
        _ip("link", "add", BRIDGE, "type", "bridge")
        _ip("addr", "add", f"{GATEWAY}/24", "dev", BRIDGE)
        _ip("link", "set", BRIDGE, "up")
        for host, address in HOSTS.items():
            _ip("netns", "add", host)
            _ip("link", "add", host, "type", "veth", "peer", "name", "eth0", "netns", host)
            _ip("link", "set", host, "master", BRIDGE, "up")
            _ip("-n", host, "addr", "add", f"{address}/24", "dev", "eth0")
            for device in ("lo", "eth0"):
                _ip("-n", host, "link", "set", device, "up")
        yield
    finally:
        for host in HOSTS:
            subprocess.run(["ip", "netns", "del", host], check=False)
        subprocess.run(["ip", "link", "del", BRIDGE], check=False)


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)


if __name__ == "__main__":
    end_as_ctrl_c()
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 8))
