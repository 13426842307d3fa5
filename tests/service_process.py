"""A real service in processes of its own, as `gripwright serve` starts it."""

import contextlib
import io
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx

LISTENING = "Gripwright listens on "


@dataclass(frozen=True)
class ServiceProcess:
    """A running service: where it listens, its process, its data."""

    address: str
    process: subprocess.Popen
    folder: Path
    environment: dict[str, str]

    def sample_package(self) -> bytes:
        """The sample product as an archive."""
        target = io.BytesIO()
        with tempfile.TemporaryDirectory() as name:
            command = [sys.executable, "-m", "gripwright.cli", "sample", f"{name}/pump"]
            subprocess.run(command, check=True, capture_output=True, env=self.environment)
            with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
                for path in sorted(Path(name, "pump").iterdir()):
                    archive.write(path, path.name)
        return target.getvalue()


@contextlib.contextmanager
def running_service(*, workers: int = 1, folder: Path | None = None, **environment: str) -> Iterator[ServiceProcess]:
    """`gripwright serve` on a free port, ready; it is told to end at the end, and has to."""
    with contextlib.ExitStack() as stack:
        folder = folder or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="gripwright-")))
        variables = {**os.environ, "GRIPWRIGHT_DATA": str(folder / "data"), "GRIPWRIGHT_WORKERS": str(workers), **environment}
        log = stack.enter_context((folder / "log").open("w"))
        command = [sys.executable, "-m", "gripwright.cli", "serve", "--port", "0"]
        process = subprocess.Popen(command, env=variables, stdout=subprocess.PIPE, stderr=log, text=True)
        stack.callback(_end, process)
        address = process.stdout.readline().strip().removeprefix(LISTENING)
        assert address, (folder / "log").read_text()
        deadline_s = time.monotonic() + 60
        while httpx.get(f"{address}/health/ready", timeout=60).status_code != 200:
            assert time.monotonic() < deadline_s, (folder / "log").read_text()
            time.sleep(0.2)
        yield ServiceProcess(address=address, process=process, folder=folder, environment=variables)


def _end(process: subprocess.Popen) -> None:
    process.terminate()
    try:
        process.wait(30)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
