"""A real service that is sent malformed uploads, and what it must look like afterwards."""

import http.client
import json
import os
import re
import sqlite3
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import psutil

LONGEST_S = 10.0
_WORKERS_OWN = (
    "pymp-"  # multiprocessing's folder for the socket of the fork server that a worker keeps (jobs/child.py), as long as it lives
)
_PARSER = "gripwright.cad.child"
_SETTLED_S = 20.0
_PYTHON_ERROR = re.compile(r"Traceback|\b[A-Z][A-Za-z]+(Error|Exception)\b|object at 0x")


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back, and after how long."""

    status: int
    headers: dict
    body: bytes
    seconds: float


class HostileService:
    """`gripwright serve` with folders of its own for data and temporary files."""

    def __init__(self, folder: Path, **settings) -> None:
        self.data, self.temporary = folder / "data", folder / "tmp"
        self.temporary.mkdir(parents=True)
        environment = {
            **os.environ,
            "GRIPWRIGHT_DATA": str(self.data),
            "GRIPWRIGHT_WORKERS": "1",
            "TMPDIR": str(self.temporary),
            **{f"GRIPWRIGHT_{name.upper()}": str(value) for name, value in settings.items()},
        }
        command = [sys.executable, "-m", "gripwright.cli", "serve", "--port", "0"]
        self.log = folder / "log"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=log, text=True)
        self.address = self.process.stdout.readline().strip().removeprefix("Gripwright listens on ")
        self.wait_until_ready()
        self.workers = self._workers()

    def wait_until_ready(self):
        deadline = time.monotonic() + 60
        while self.get("/health/ready").status != 200:
            assert time.monotonic() < deadline, "the service is not ready"
            time.sleep(0.2)

    def stop(self):
        self.process.terminate()
        try:
            self.process.wait(30)
        finally:
            self.process.kill()

    def get(self, path):
        return self._ask("GET", path, None, {})

    def upload(self, bad):
        headers = {"Content-Type": bad.content_type} if bad.content_type else {}
        return self._ask("POST", "/api/v1/products", bad.body, headers)

    def _ask(self, method, path, body, headers):
        connection = http.client.HTTPConnection(urlsplit(self.address).netloc, timeout=30)
        started = time.monotonic()
        try:
            with suppress(BrokenPipeError, ConnectionResetError):  # it answers before all has come
                connection.request(method, path, body, headers)
            answer = connection.getresponse()
            data = answer.read()
            return Answer(answer.status, dict(answer.getheaders()), data, time.monotonic() - started)
        except (OSError, http.client.HTTPException) as error:
            return Answer(0, {}, repr(error).encode(), time.monotonic() - started)
        finally:
            connection.close()

    def faults_of(self, answer):
        """What is wrong with the answer to a malformed upload; empty where it is as it must be."""
        if not 400 <= answer.status < 500:
            return [f"answered {answer.status}: {answer.body[:300]!r}"]
        faults = []
        if answer.headers.get("content-type") != "application/problem+json":
            faults.append(f"media type {answer.headers.get('content-type')}")
        problem = json.loads(answer.body)
        if not all(problem.get(key) for key in ("type", "title", "detail")) or problem.get("status") != answer.status:
            faults.append(f"not a whole problem: {problem}")
        said = problem.get("detail", "") + " ".join(error["message"] for error in problem.get("errors", []))
        if _PYTHON_ERROR.search(said) or len(said) < 15:
            faults.append(f"says {said[:300]!r}")
        if len(answer.body) > 500_000:
            faults.append(f"answers with {len(answer.body)} bytes")
        if answer.seconds > LONGEST_S:
            faults.append(f"took {answer.seconds:.1f} s")
        return faults

    def leftovers(self):
        """What a refused upload must not leave: files, rows, processes."""
        files = [path.relative_to(self.data) for path in (self.data / "artifacts").rglob("*") if path.is_file()]
        with sqlite3.connect(self.data / "gripwright.db") as database:
            products = database.execute("SELECT COUNT(*) FROM product").fetchone()[0]
        return {
            "artifacts": sorted(map(str, files)),
            "products": products,
            "temporary": sorted(path.name for path in self.temporary.iterdir() if not path.name.startswith(_WORKERS_OWN)),
            "parsers": self._settled_parsers(),
        }

    def _settled_parsers(self):
        """How many processes read CAD: the one that is kept ready is started after an upload took the one before it."""
        deadline = time.monotonic() + _SETTLED_S
        while (count := sum(map(_is_parser, self._children()))) != 1 and time.monotonic() < deadline:
            time.sleep(0.1)
        return count

    def _children(self):
        return psutil.Process(self.process.pid).children(recursive=True)

    def _workers(self):
        return {child.pid for child in psutil.Process(self.process.pid).children() if not _is_parser(child)}

    def is_alive(self):
        """API and workers, the same processes as at the start."""
        return self.process.poll() is None and self.workers <= self._workers() and self.get("/health/ready").status == 200

    def defects(self):
        """What the log tells of defects."""
        return [line for line in self.log.read_text().splitlines() if "defect" in line or "Traceback" in line]


def _is_parser(process):
    with suppress(psutil.NoSuchProcess, psutil.ZombieProcess):
        return _PARSER in " ".join(process.cmdline())
    return False


@contextmanager
def hostile_service(folder, **settings):
    service = HostileService(folder, **settings)
    try:
        yield service
    finally:
        service.stop()
