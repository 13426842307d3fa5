"""All data from one database into another, of the same kind or not, compared afterwards; and the artifacts that it names."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, Table, func, insert, select, text, update
from sqlalchemy.exc import DataError

from gripwright.domain.errors import Conflict, InvalidInput
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.engines import Database
from gripwright.store.migrate import require_current, upgrade_tables, without_foreign_keys
from gripwright.store.models import ActuatorRow, Base, JobRow, WorkerRow
from gripwright.store.named import named_artifacts
from gripwright.store.seed import seed_actuators

_ROWS_AT_A_TIME = 500
_DIGESTS = 2**256
DATA_TABLES = [table for table in Base.metadata.sorted_tables if table is not WorkerRow.__table__]  # who works is no data


@contextmanager
def snapshot(database: Database) -> Iterator[Connection]:
    """A connection that sees one moment of a database at this version, while others go on writing."""
    require_current(database)
    with database.read_engine.connect() as connection:
        if connection.dialect.name == "postgresql":
            connection = connection.execution_options(isolation_level="REPEATABLE READ")
        with connection.begin():
            yield connection


def copy_rows(source: Connection, target: Database, *, replace: bool = False, requeue: bool = True) -> dict[str, int]:
    """Fill a database, all or nothing: how many rows each table got. Its tables are made where they are not there.

    Conflict where it holds data already, unless that is to be replaced. With `requeue` designs that wait or run are queued anew,
    for the job engine's own tables are not copied.
    """
    with target.write_engine.connect() as connection, without_foreign_keys(connection), connection.begin():
        upgrade_tables(connection)
        if not replace:
            _require_empty(connection)
        for table in reversed(Base.metadata.sorted_tables):
            connection.execute(table.delete())
        counts = {table.name: _copy_table(source, connection, table) for table in DATA_TABLES}
        if requeue:
            _requeue(connection)
    return counts


def copy_artifacts(names: Iterator[str], source: ArtifactStore, target: ArtifactStore) -> int:
    """Copy artifacts that the target lacks; how many. InvalidInput where one is not what its name says."""
    copied = 0
    for sha256 in names:
        if target.has(sha256):
            continue
        if target.put(source.get(sha256)) != sha256:
            raise InvalidInput(f"the artifact {sha256} is damaged: its content has another sha-256")
        copied += 1
    return copied


def names_in(database: Database) -> list[str]:
    """The artifacts that a database names."""
    with database.read_engine.connect() as connection:
        return list(named_artifacts(connection))


def _require_empty(connection: Connection) -> None:
    """Conflict where there is anything but the first catalogue."""
    for table in DATA_TABLES:
        count = connection.scalar(select(func.count()).select_from(table)) or 0
        if count and not (table is ActuatorRow.__table__ and _is_first_catalogue(connection)):
            raise Conflict(f"the target is not empty: its table {table.name} has {count} rows", table=table.name, rows=count)


def _is_first_catalogue(connection: Connection) -> bool:
    rows = connection.execute(select(ActuatorRow.maker, ActuatorRow.model, ActuatorRow.version)).all()
    return {tuple(row) for row in rows} == {(actuator.maker, actuator.model, 1) for actuator in seed_actuators()}


def _copy_table(source: Connection, target: Connection, table: Table) -> int:
    count, digest = 0, 0
    rows = source.execution_options(yield_per=_ROWS_AT_A_TIME).execute(select(table)).mappings()
    for part in rows.partitions(_ROWS_AT_A_TIME):
        batch = [dict(row) for row in part]
        try:
            target.execute(insert(table), batch)
        except DataError as error:
            raise InvalidInput(f"the target cannot hold a row of {table.name}: {error.orig}") from error
        count, digest = count + len(batch), digest + sum(map(_digest, batch))
    written = [_digest(row) for row in target.execute(select(table)).mappings()]
    if (count, digest % _DIGESTS) != (len(written), sum(written) % _DIGESTS):
        raise Conflict(f"the table {table.name} has other content in the target: {len(written)} rows of {count}")
    _continue_numbers(source, target, table)
    return count


def _digest(row: Mapping[Any, Any]) -> int:
    """A row as a number; sums of such numbers do not depend on the order of rows, which databases sort differently."""
    spelt = json.dumps([[str(name), value] for name, value in row.items()], sort_keys=True, default=_spelt)
    return int.from_bytes(hashlib.sha256(spelt.encode()).digest())


def _spelt(value: datetime | bytes) -> str:
    return value.hex() if isinstance(value, bytes) else value.isoformat()


def _continue_numbers(source: Connection, target: Connection, table: Table) -> None:
    """Let the target count on where the source stands, so that no number is ever given twice."""
    column = table.autoincrement_column
    if column is None:
        return
    last = _last_number(source, table, column.name)
    if target.dialect.name == "sqlite":
        target.execute(text("DELETE FROM sqlite_sequence WHERE name = :name"), {"name": table.name})
        target.execute(text("INSERT INTO sqlite_sequence (name, seq) VALUES (:name, :last)"), {"name": table.name, "last": last})
    elif last:
        place = {"name": table.name, "column": column.name, "last": last}
        target.execute(text("SELECT setval(pg_get_serial_sequence(:name, :column), :last)"), place)


def _last_number(connection: Connection, table: Table, column: str) -> int:
    if connection.dialect.name == "sqlite":
        query = text("SELECT seq FROM sqlite_sequence WHERE name = :name")
        return connection.scalar(query, {"name": table.name}) or 0
    sequence = connection.scalar(text("SELECT pg_get_serial_sequence(:name, :column)"), {"name": table.name, "column": column})
    state = connection.execute(text(f"SELECT last_value, is_called FROM {sequence}")).one()
    return state.last_value if state.is_called else 0


def _requeue(connection: Connection) -> None:
    job = JobRow.__table__.c
    unfinished = (job.status == "running") | ((job.status == "queued") & job.dispatched)
    values = {"status": "queued", "dispatched": False, "attempt": job.attempt + 1, "fraction": 0.0, "started_at": None}
    connection.execute(update(JobRow.__table__).where(unfinished).values(values))  # type: ignore[arg-type]
