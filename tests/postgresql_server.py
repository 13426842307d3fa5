"""A PostgreSQL of the tests' own, from Debian's package: started, stopped and restarted at will."""

import contextlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest


class PostgresqlServer:
    """A cluster in a folder. It listens on a socket there, and on `address` where one is given ("10.0.0.1:5433")."""

    def __init__(self, folder: Path, binaries: Path, address: str | None = None) -> None:
        self._folder, self._binaries = folder, binaries
        self._host, _, self._port = (address or "").partition(":")
        self._as_user = ["setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups"] if os.geteuid() == 0 else []
        if self._as_user:
            shutil.chown(folder, "nobody", "nogroup")
        self._run("initdb", "-A", "trust", "-U", "test")
        if self._host:
            with (folder / "data" / "pg_hba.conf").open("a") as rules:
                rules.write("host all all 0.0.0.0/0 trust\n")

    def start(self) -> None:
        """Start, and wait until it answers."""
        listening = f"-c listen_addresses='{self._host}'" + (f" -c port={self._port}" if self._port else "")
        options = f"{listening} -c unix_socket_directories={self._folder} -c fsync=off -c max_connections=200"
        self._run("pg_ctl", "-w", "-o", options, "-l", str(self._folder / "log"), "start")

    def stop(self, mode: str = "immediate") -> None:
        """Stop: "immediate" as a crash does, "fast" as an administrator does."""
        self._run("pg_ctl", "-m", mode, "-w", "stop")

    def url(self, database: str = "postgres") -> str:
        """The address of a database over the socket."""
        return f"postgresql://test@/{database}?host={self._folder}" + (f"&port={self._port}" if self._port else "")

    def network_url(self, database: str = "postgres") -> str:
        """The address of a database over the network."""
        return f"postgresql://test@{self._host}:{self._port}/{database}"

    def create_database(self, name: str) -> str:
        """The address of a new, empty database."""
        with psycopg.connect(self.url(), autocommit=True) as connection:
            connection.execute(f'CREATE DATABASE "{name}"')
        return self.url(name)

    def _run(self, program: str, *arguments: str) -> None:
        command = [*self._as_user, str(self._binaries / program), "-D", str(self._folder / "data"), *arguments]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
        assert done.returncode == 0, done.stderr


@contextlib.contextmanager
def running_postgresql(address: str | None = None) -> Iterator[PostgresqlServer]:
    """A started server, gone afterwards. Skips where PostgreSQL is not installed, fails with CI=true."""
    binaries = _binaries()
    if binaries is None:
        if os.environ.get("CI") == "true":
            pytest.fail("PostgreSQL is not installed")
        pytest.skip("PostgreSQL is not installed")
    with tempfile.TemporaryDirectory(prefix="gripwright-pg-") as folder:
        server = PostgresqlServer(Path(folder), binaries, address)
        server.start()
        try:
            yield server
        finally:
            with contextlib.suppress(AssertionError):  # a test may have stopped it
                server.stop()


def _binaries() -> Path | None:
    """Where Debian's package has its programs, or whoever put `postgres` on the path."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/postgres"))
    on_path = shutil.which("postgres")
    return found[-1].parent if found else Path(on_path).resolve().parent if on_path else None
