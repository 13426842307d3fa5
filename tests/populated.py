"""Databases with rows in every table, made from the tables' own columns: a new one is filled without a change here."""

import hashlib
from datetime import UTC, datetime, timedelta

from sqlalchemy import JSON, Boolean, DateTime, Float, Integer, LargeBinary, String, insert, select

from gripwright.store.columns import UtcDateTime

ROWS = 3
_MOMENT = datetime(2026, 1, 2, 3, 4, 5, 678901, tzinfo=UTC)
_ALLOWED = {
    ("job", "status"): ("queued", "running", "succeeded"),
    ("webhook_delivery", "status"): ("pending", "delivered", "failed"),
    ("api_key", "scope"): ("read", "write", "admin"),
}
_JSON = ({"ä": [1, 2.5, None, "x"]}, [], {"nested": {"deep": [True]}})


def populate(connection, metadata, skip=()):
    """Put three rows into each table; a nullable column is null in the second. Parents come before children."""
    for table in metadata.sorted_tables:
        if table.name not in (*skip, "alembic_version"):
            connection.execute(table.delete())
            connection.execute(insert(table), [_row(table, number) for number in range(ROWS)])


def contents(connection, metadata):
    """Table → its rows as dictionaries, in an order that does not depend on the database."""
    return {
        table.name: sorted((dict(row) for row in connection.execute(select(table)).mappings()), key=repr)
        for table in metadata.sorted_tables
        if table.name != "alembic_version"
    }


def _row(table, number):
    return {column.name: _value(table, column, number) for column in table.columns}


def _value(table, column, number):
    parent = next(iter(column.foreign_keys), None)
    if parent is not None:
        return _value(parent.column.table, parent.column, number)
    if (table.name, column.name) in _ALLOWED:
        return _ALLOWED[table.name, column.name][number]
    if column.nullable and number == 1:
        return None
    kind = column.type
    if isinstance(kind, JSON):
        return _JSON[number]
    if isinstance(kind, UtcDateTime | DateTime):
        moment = _MOMENT + timedelta(days=number)
        return moment if isinstance(kind, UtcDateTime) else moment.replace(tzinfo=None)
    if isinstance(kind, Boolean):
        return number == 0
    if isinstance(kind, Integer):
        return 1000 + 7 * number
    if isinstance(kind, Float):
        return number + 0.1
    if isinstance(kind, LargeBinary):
        return bytes([number, 0, 255])
    assert isinstance(kind, String), f"{table.name}.{column.name} has a type that no value is known for: {kind!r}"
    spelt = f"{table.name}.{column.name}.{number}"
    if kind.length in (32, 64):
        return hashlib.sha256(spelt.encode()).hexdigest()[: kind.length]
    return f"{spelt} ü"[: kind.length]
