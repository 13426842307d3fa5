"""The commands of docs/api.md, run as they are printed there."""

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
START, *BLOCKS = re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
_STRICT = """set -euo pipefail
curl() { if [ "$1" = -sf ]; then command curl "$@"; else command curl --fail-with-body --max-time 900 "$@"; fi; }
"""


def run_page(folder, blocks, *, workers, timeout_s):
    """Start the service as the page says, and run blocks of commands one after another: exit code, and what was printed."""
    missing = [tool for tool in ("curl", "zip", "jq") if shutil.which(tool) is None]
    if missing and not os.environ.get("CI"):
        pytest.skip(f"not installed: {', '.join(missing)}")
    (folder / ".venv").symlink_to(sys.prefix)
    (folder / "openapi").symlink_to(Path(__file__).parents[1] / "openapi")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    environment = {**os.environ, "GRIPWRIGHT_DATA": str(folder / "data"), "GRIPWRIGHT_WORKERS": str(workers)}

    def shell(commands):
        return subprocess.Popen(
            ["bash", "-c", (_STRICT + commands).replace("8000", port)],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    service, commands = shell(f"exec {START}"), shell("".join(blocks) + "echo THE END\n")
    try:
        printed, _ = commands.communicate(timeout=timeout_s)
    finally:
        for process in (commands, service):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
            process.communicate(timeout=30)
    return commands.returncode, printed
