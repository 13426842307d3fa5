"""Shared by all tests: modules beside this file can be imported by name."""

import secrets
from collections.abc import Iterator

import pytest

from designed_products import Designed, designer
from postgresql_server import PostgresqlServer, running_postgresql
from s3_server import S3Server, running_s3


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Where tests run side by side, those of a file stay together, and so do all that look at the same whole designs."""
    for item in items:
        needs_designs = "designed" in getattr(item, "fixturenames", ())
        item.add_marker(pytest.mark.xdist_group("designs" if needs_designs else item.path.name))


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
