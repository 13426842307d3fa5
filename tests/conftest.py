"""Shared by all tests: modules beside this file can be imported by name."""

import re
import secrets
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

from designed_products import Designed, designer
from postgresql_server import PostgresqlServer, running_postgresql
from s3_server import S3Server, running_s3

_ASKS_FOR_DESIGNS = re.compile(r"^def \w+\([^)]*\bdesigned\b", re.MULTILINE)


class TogetherScheduling(LoadScopeScheduling):
    """Where tests run side by side, those of a file stay together, and so do all files that look at the same whole designs."""

    def _split_scope(self, nodeid: str) -> str:
        return _scope_of(self.config.rootpath / nodeid.partition("::")[0])


@cache
def _scope_of(file: Path) -> str:
    return "designs" if _ASKS_FOR_DESIGNS.search(file.read_text(encoding="utf-8")) else str(file)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> TogetherScheduling:
    return TogetherScheduling(config, log)


@pytest.fixture(scope="session")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Designed:
    """Whole designs by the command line, each made once a session."""
    return designer(tmp_path_factory)


@pytest.fixture(scope="session")
def postgresql_server() -> Iterator[PostgresqlServer]:
    """One PostgreSQL for all tests that do not stop it; each takes a database of its own."""
    with running_postgresql() as server:
        yield server


@pytest.fixture
def postgresql(postgresql_server: PostgresqlServer) -> str:
    """The address of an empty PostgreSQL database."""
    return postgresql_server.create_database(f"test_{secrets.token_hex(6)}")


@pytest.fixture(scope="session")
def s3_server() -> Iterator[S3Server]:
    """One S3 protocol server for all tests."""
    with running_s3() as server:
        yield server


@pytest.fixture
def s3_storage(s3_server: S3Server, monkeypatch: pytest.MonkeyPatch) -> str:
    """The URL of an empty folder in a bucket of its own; the environment has what is needed to use it."""
    for name, value in s3_server.environment.items():
        monkeypatch.setenv(name, value)
    return s3_server.create_bucket()
