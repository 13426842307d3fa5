"""What the database needs of the storage: the artifacts that it names, and the time since when steps may be in use."""

from collections.abc import Iterator
from datetime import datetime

from sqlalchemy import Connection, func, select, union

from gripwright.store.engines import Database
from gripwright.store.models import ComponentRow, DesignFileRow, DesignRow, JobRow, ProductRow

ARTIFACT_COLUMNS = (
    ProductRow.content_sha256,
    ProductRow.task_sha256,
    ComponentRow.glb_sha256,
    DesignRow.task_sha256,
    DesignRow.actuators_sha256,
    DesignFileRow.sha256,
)
"""Every column that holds the name of an artifact."""


def named_artifacts(connection: Connection) -> Iterator[str]:
    """The sha-256 of every artifact that a row names, each once, in order."""
    names = union(*(select(column.label("sha256")) for column in ARTIFACT_COLUMNS)).subquery()
    for row in connection.execute(select(names.c.sha256).order_by(names.c.sha256)):
        yield row.sha256


def oldest_start(database: Database) -> datetime | None:
    """When the design started that has run longest; None where none runs."""
    with database.read_sessions() as session:
        return session.scalar(select(func.min(JobRow.started_at)).where(JobRow.status == "running"))
