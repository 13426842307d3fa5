"""An S3 protocol server of the tests' own: moto's, in a process of its own."""

import contextlib
import os
import secrets
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import httpx

CREDENTIALS = {"AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_REGION": "us-east-1"}


class S3Server:
    """A running server. `environment` is what a client needs."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.environment = {**CREDENTIALS, "AWS_ENDPOINT_URL": address}

    def create_bucket(self) -> str:
        """The URL of a folder in a new bucket."""
        name = f"bucket-{secrets.token_hex(6)}"
        httpx.put(f"{self.address}/{name}").raise_for_status()
        return f"s3://{name}/some/folder"


@contextlib.contextmanager
def running_s3(host: str = "127.0.0.1") -> Iterator[S3Server]:
    """A started server, gone afterwards with all that it holds."""
    with socket.socket() as probe:
        probe.bind((host, 0))
        port = probe.getsockname()[1]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, "-m", "moto.server", "-H", host, "-p", str(port)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        address, deadline = f"http://{host}:{port}", time.monotonic() + 60
        while True:
            with contextlib.suppress(httpx.TransportError):
                httpx.get(f"{address}/moto-api/")
                break
            assert process.poll() is None, "the server ended"
            assert time.monotonic() < deadline, "the server did not start"
            time.sleep(0.1)
        yield S3Server(address)
    finally:
        process.kill()
        process.wait()
