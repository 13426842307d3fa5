"""Column types and identifiers shared by the tables."""

import secrets
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import DateTime, Dialect
from sqlalchemy.types import TypeDecorator


class UtcDateTime(TypeDecorator[datetime]):
    """A moment in UTC, aware. (`DateTime(timezone=True)` loses the zone on SQLite.)"""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """To naive UTC, as stored."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError("a time without a zone cannot be stored")
        return value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: Any | None, dialect: Dialect) -> datetime | None:
        """To aware UTC."""
        return None if value is None else value.replace(tzinfo=UTC)


def new_id(now: datetime) -> str:
    """An identifier that sorts by time, like a UUIDv7: 48 bits of milliseconds, 80 random bits, 32 hex digits."""
    return f"{int(now.timestamp() * 1000):012x}{secrets.token_hex(10)}"


def utc_now() -> datetime:
    """The present moment, for the outermost layer that passes time as an argument."""
    return datetime.now(UTC)
