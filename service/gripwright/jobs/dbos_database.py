"""DBOS and its database: connections, the journal of SQLite, and which errors it waits out."""

import sqlite3
from pathlib import Path
from typing import Any

import dbos._sys_db
from dbos._utils import retriable_postgres_exception
from sqlalchemy.exc import OperationalError

from gripwright.store.engines import NETWORK

_HEALING = ("database is locked", "database or disk is full", "disk I/O error", "unable to open database file")


def engine_options(database_url: str) -> dict[str, Any]:
    """Connections that end in time when a host is cut off."""
    return {} if database_url.startswith("sqlite") else {"connect_args": dict(NETWORK)}


def _may_heal(e: Exception) -> bool:
    """Whether DBOS is to try again what it has to record; what it gives up is forgotten, and the workflow would never end.

    By itself it waits for a locked SQLite, not for a full disk, and does not know every way to say that PostgreSQL is not there.
    """
    if isinstance(e, OperationalError):
        is_silent = getattr(e.orig, "sqlstate", "") is None  # no server said so
        if is_silent or any(word in str(e.orig) for word in _HEALING):
            return True
    return retriable_postgres_exception(e)


def prepare_database(database_url: str) -> None:
    """Before DBOS opens it, which leaves SQLite in a journal where readers and writers block each other."""
    dbos._sys_db.retriable_sqlite_exception = _may_heal  # type: ignore[attr-defined]  # nothing public says so
    dbos._sys_db.retriable_postgres_exception = _may_heal  # type: ignore[attr-defined]
    scheme, _, path = database_url.partition(":///")
    if scheme.startswith("sqlite"):
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        with sqlite3.connect(path) as connection:
            connection.execute("PRAGMA journal_mode=WAL")
        connection.close()
