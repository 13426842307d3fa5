"""A service in a process of its own, on a free port of this machine."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import httpx

READY_S = 60.0


@contextmanager
def running_service(data: Path, **settings: str) -> Iterator[str]:
    """The address of a service that is ready; settings by their names without the prefix. It has no workers."""
    chosen: Mapping[str, str] = {"DATA": str(data), "WORKERS": "0", **settings}
    environment = {**os.environ, **{f"GRIPWRIGHT_{name}": value for name, value in chosen.items()}}
    command = [sys.executable, "-m", "gripwright.cli", "serve", "--port", "0"]
    data.mkdir(parents=True, exist_ok=True)
    with (data / "log").open("wb") as log:
        process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=log, text=True)
        try:
            assert process.stdout is not None
            address = process.stdout.readline().strip().removeprefix("Gripwright listens on ")
            assert address, (data / "log").read_text()
            deadline = time.monotonic() + READY_S
            while httpx.get(f"{address}/health/ready", timeout=READY_S).status_code != 200:
                assert time.monotonic() < deadline, (data / "log").read_text()
                time.sleep(0.1)
            yield address
        finally:
            process.terminate()
            process.wait(30)
