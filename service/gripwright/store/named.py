"""Which artifacts the database names: what is kept, copied and backed up."""

from collections.abc import Iterator

from sqlalchemy import Connection, select, union

from gripwright.store.models import ComponentRow, DesignFileRow, DesignRow, ProductRow

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
