"""Bringing a database to the newest version of the tables, and refusing to work with an older one."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection
from sqlalchemy.orm import Session

import gripwright
from gripwright.domain.errors import Conflict
from gripwright.store.actuators import ActuatorRepository
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.seed import seed_actuators

_PACKAGED = Path(__file__).resolve().parents[1] / "migrations"  # in an installed wheel
_SOURCE = Path(__file__).resolve().parents[3] / "migrations"  # in the source tree
_LOCK = 0x67726970  # of PostgreSQL's advisory locks: one migration at a time


def alembic_config(connection: Connection | None = None) -> Config:
    """Alembic's configuration with the migrations that came with this version."""
    config = Config()
    config.set_main_option("script_location", str(_PACKAGED if _PACKAGED.is_dir() else _SOURCE))
    config.attributes["connection"] = connection
    return config


def migrate(database: Database) -> None:
    """Run the migrations that this database lacks, all or none; a new one gets its catalogue.

    Several processes may start at once: one migrates, the others wait.
    """
    with database.write_engine.connect() as connection, without_foreign_keys(connection), connection.begin():
        if upgrade_tables(connection):
            with Session(connection, join_transaction_mode="create_savepoint") as session, session.begin():
                ActuatorRepository(session).fill(seed_actuators(), utc_now())


def upgrade_tables(connection: Connection) -> bool:
    """Run the missing migrations in the caller's transaction; whether there was none before."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_LOCK})")
    is_new = MigrationContext.configure(connection).get_current_revision() is None
    try:
        command.upgrade(alembic_config(connection), "head")
    except CommandError as error:
        raise Conflict(f"the database is of a newer version than this one, {gripwright.__version__}: {error}") from error
    return is_new


def prepare(database: Database, *, automatically: bool) -> None:
    """Migrate where that is allowed; Conflict where the database is not at this version afterwards."""
    if automatically:
        migrate(database)
    require_current(database)


def require_current(database: Database) -> None:
    """Conflict where the database is not at this version's newest migration."""
    expected = _newest()
    with database.read_engine.connect() as connection:
        found = MigrationContext.configure(connection).get_current_revision()
    if found != expected:
        raise Conflict(
            f"the database is at migration {found or 'none'}, this version needs {expected}: run `gripwright migrate`",
            found=found,
            expected=expected,
        )


def require_writable(database: Database) -> None:
    """An error of SQLAlchemy where nothing can be written: a standby, a read-only file."""
    with database.write_engine.connect() as connection:  # never committed
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = version_num")


@cache
def _newest() -> str | None:
    """The newest migration that came with this version."""
    return ScriptDirectory.from_config(alembic_config()).get_current_head()


@contextmanager
def without_foreign_keys(connection: Connection) -> Iterator[None]:
    """Where SQLite checks no foreign keys, which can only be switched outside of a transaction.

    It changes a table by copying it, which they would take for a deletion.
    """
    if connection.dialect.name != "sqlite":
        yield
        return
    driver: Any = connection.connection.driver_connection
    driver.execute("PRAGMA foreign_keys=OFF")
    try:
        yield
    finally:
        driver.execute("PRAGMA foreign_keys=ON")
