"""Database engines. SQLite: WAL, writers take the lock at once (`BEGIN IMMEDIATE`), readers have an engine of their own."""

import sqlite3
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import DBAPIError, InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeout
from sqlalchemy.orm import Session, sessionmaker

BUSY_TIMEOUT_S = 30.0
DATABASE_FAILURES = (OperationalError, InterfaceError, PoolTimeout)
"""Of a database that does not answer, or has no connection left."""

PASSING_ERRORS = (*DATABASE_FAILURES, OSError)
"""Of a database or a disk that may be well again a moment later: locked, restarting, full."""
_CONNECTIONS = 40  # one for each thread that serves requests

NETWORK: Mapping[str, Any] = MappingProxyType(
    {
        "connect_timeout": 10,
        "keepalives_idle": 10,
        "keepalives_interval": 5,
        "keepalives_count": 3,
        "tcp_user_timeout": 30_000,  # ms
        "options": "-c tcp_keepalives_idle=10 -c tcp_keepalives_interval=5 -c tcp_keepalives_count=3"
        " -c idle_in_transaction_session_timeout=60000",
    }
)
"""How PostgreSQL's connections end when a host is cut off, on both sides: the server's hold locks that others wait for."""


class Database:
    """The write and the read sessions of one database."""

    def __init__(self, url: str) -> None:
        self.url = url
        self.write_engine = _engine(url, begin="BEGIN IMMEDIATE")
        self.read_engine = _engine(url, begin="BEGIN")
        self._glance_lock = threading.Lock()
        self._glance: Connection | None = None
        self.write_sessions: sessionmaker[Session] = sessionmaker(self.write_engine, expire_on_commit=False)
        self.read_sessions: sessionmaker[Session] = sessionmaker(self.read_engine, expire_on_commit=False)

    @contextmanager
    def glance(self) -> Iterator[Connection]:
        """A connection for one small query that is asked again and again.

        PostgreSQL keeps it open and begins no transaction: a round trip in place of four. SQLite has none to save.
        """
        if self.read_engine.dialect.name == "sqlite":
            with self.read_engine.connect() as connection:
                yield connection
            return
        with self._glance_lock:
            if self._glance is None:
                self._glance = self.read_engine.connect().execution_options(isolation_level="AUTOCOMMIT")
            try:
                yield self._glance
                self._glance.commit()
            except DBAPIError:
                self._glance.invalidate()
                self._glance.close()
                self._glance = None
                raise

    def dispose(self) -> None:
        """Close all connections."""
        if self._glance is not None:
            self._glance.close()
        self.write_engine.dispose()
        self.read_engine.dispose()


def is_full(error: BaseException | None) -> bool:
    """Whether a driver's error says that the database's disk is full."""
    return getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL or getattr(error, "sqlstate", None) == "53100"


def _engine(url: str, *, begin: str) -> Engine:
    if make_url(url).get_backend_name() != "sqlite":
        return create_engine(url, connect_args=dict(NETWORK), pool_pre_ping=True, max_overflow=_CONNECTIONS)
    engine = create_engine(url, connect_args={"timeout": BUSY_TIMEOUT_S}, pool_size=_CONNECTIONS)  # all stay open: they are files
    event.listen(engine, "connect", _configure_sqlite)
    event.listen(engine, "begin", _begin_with(begin))
    return engine


def _configure_sqlite(connection: Any, _record: object) -> None:
    connection.isolation_level = None  # pysqlite must not begin by itself: the "begin" event does
    cursor = connection.cursor()
    for pragma in ("journal_mode=WAL", "synchronous=NORMAL", "foreign_keys=ON"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _begin_with(statement: str) -> Callable[[Connection], None]:
    def begin(connection: Connection) -> None:
        connection.exec_driver_sql(statement)

    return begin
