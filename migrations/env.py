"""Alembic's environment: run by `gripwright.store.migrate`, or by alembic itself with `-x url=…`."""

from typing import Any

from alembic import context
from sqlalchemy import Connection

from gripwright.store.columns import UtcDateTime
from gripwright.store.engines import Database
from gripwright.store.models import Base


def include_name(name: str | None, kind: str, parents: object) -> bool:
    """Only our own tables: the job engine keeps its own elsewhere."""
    return kind != "table" or name in Base.metadata.tables


def render_item(kind: str, item: Any, autogen_context: object) -> str | bool:
    """Migrations name plain column types: they must run long after the code has changed."""
    return "sa.DateTime()" if kind == "type" and isinstance(item, UtcDateTime) else False


def run(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=Base.metadata,
        include_name=include_name,
        render_item=render_item,
        render_as_batch=True,
        compare_type=True,
    )
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is not None:
    run(given)
else:
    with Database(context.get_x_argument(as_dictionary=True)["url"]).write_engine.begin() as opened:
        run(opened)
