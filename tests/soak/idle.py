"""What an idle service costs, and how soon it begins when asked: one API process and two workers, on SQLite and on PostgreSQL.

usage: python tests/soak/idle.py [--seconds 30] [--designs 40]

Processor time is that of all its processes by the kernel's count, without PostgreSQL's own. Exit code 1: more than 5 % of a core,
or 95 % of the designs did not run within 300 ms of their request.
"""

import argparse
import contextlib
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx
import psutil

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests")]

from gripwright.settings import Settings  # noqa: E402
from gripwright.store.engines import Database  # noqa: E402
from gripwright.store.events import EventRepository  # noqa: E402
from gripwright.store.migrate import migrate  # noqa: E402
from gripwright.store.storage import open_artifacts  # noqa: E402
from postgresql_server import running_postgresql  # noqa: E402
from service_factory import store_product  # noqa: E402

CORE_MAX, START_MAX_S = 0.05, 0.3
_SETTLE_S = 25.0  # imports, and the listing of the plug-ins


@contextlib.contextmanager
def service(folder, server):
    """Address, database and root process of a service."""
    settings = Settings(
        data_dir=folder, database_url=server and server.url(), jobs_database_url=server and server.url(), workers=2
    )
    folder.mkdir(exist_ok=True)
    database = Database(settings.resolved_database_url)
    migrate(database)
    environment = {**os.environ, "GRIPWRIGHT_DATA": str(folder), "GRIPWRIGHT_WORKERS": "2"}
    if server:
        environment |= {"GRIPWRIGHT_DATABASE_URL": server.url(), "GRIPWRIGHT_JOBS_DATABASE_URL": server.url()}
    command = [sys.executable, "-m", "gripwright.cli", "serve", "--port", "0"]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as api:
        try:
            address = re.search(r"http://\S+", api.stdout.readline())[0]
            yield address, database, psutil.Process(api.pid)
        finally:
            api.terminate()
            database.dispose()


def processor_s(root):
    """Processor time of a process and all below it so far."""
    total = 0.0
    for process in [root, *root.children(recursive=True)]:
        with contextlib.suppress(psutil.Error):
            times = process.cpu_times()
            total += times.user + times.system
    return total


def start_s(client, database, product_id):
    """From a request to its job's start."""
    asked_s = time.time()
    job = client.post(f"/api/v1/products/{product_id}/designs", json={}).raise_for_status().json()["id"]
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        time.sleep(0.05)
        with database.read_sessions() as session:
            running = [row for row in EventRepository(session).after(job, 0, 100) if row.data["status"] == "running"]
        if running:
            break
    client.post(f"/api/v1/jobs/{job}/cancel")
    time.sleep(1.5)
    return running[0].created_at.timestamp() - asked_s


def measure(name, server, chosen):
    with (
        tempfile.TemporaryDirectory(prefix="gripwright-idle-", ignore_cleanup_errors=True) as folder,
        service(Path(folder) / "data", server) as (address, database, root),
        httpx.Client(base_url=address, timeout=90.0) as client,
    ):
        product_id = store_product(database, open_artifacts(Settings(data_dir=Path(folder) / "data").resolved_storage_url))
        start_s(client, database, product_id)
        time.sleep(_SETTLE_S)
        before, since = processor_s(root), time.monotonic()
        time.sleep(chosen.seconds)
        share = (processor_s(root) - before) / (time.monotonic() - since)
        starts = sorted(start_s(client, database, product_id) for _ in range(chosen.designs))
    p50, p95 = (starts[int(part * (len(starts) - 1))] for part in (0.5, 0.95))
    print(f"{name}: idle {share:.1%} of a core, start p50 {p50:.3f} s, p95 {p95:.3f} s, max {starts[-1]:.3f} s", flush=True)
    return share <= CORE_MAX and p95 <= START_MAX_S


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--designs", type=int, default=40)
    chosen = parser.parse_args()
    holds = [measure("SQLite", None, chosen)]
    with running_postgresql() as server:
        holds.append(measure("PostgreSQL", server, chosen))
    return 0 if all(holds) else 1


if __name__ == "__main__":
    sys.exit(main())
