"""`gripwright backup`, `gripwright restore` and `gripwright copy`."""

from pathlib import Path
from typing import Annotated

import typer

from gripwright.domain.errors import Conflict
from gripwright.jobs.catalogue import prepared_database
from gripwright.jobs.hosts import ProcessName
from gripwright.settings import Settings, load_settings, with_driver
from gripwright.store.backup import make_backup, restore_backup
from gripwright.store.engines import Database
from gripwright.store.named import named_artifacts
from gripwright.store.storage import open_artifacts
from gripwright.store.transfer import copy_artifacts, copy_rows, snapshot
from gripwright.store.workers import standing_workers


def backup(folder: Annotated[Path, typer.Argument(metavar="DIR", help="new, or that of an earlier backup")]) -> None:
    """Database and artifacts as they are at one moment, into a folder. The service may run."""
    settings = load_settings()
    database = prepared_database(settings)
    made = make_backup(database, open_artifacts(settings.resolved_storage_url), folder)
    database.dispose()
    typer.echo(f"{made.rows} rows and {made.artifacts} artifacts are in {folder}")


def restore(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="of a backup")],
    force: Annotated[bool, typer.Option("--force", help="replace the data that is there")] = False,
) -> None:
    """A backup into the database and the storage of the settings. The service must not run."""
    settings = load_settings()
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    database = prepared_database(settings) if settings.uses_default_database else Database(settings.resolved_database_url)
    _require_silence(settings, database)
    restored = restore_backup(folder, database, open_artifacts(settings.resolved_storage_url), replace=force)
    database.dispose()
    if settings.jobs_database_url is None:
        for path in settings.data_dir.glob("jobs.sqlite*"):  # what the job engine knew is of another time
            path.unlink()
    typer.echo(f"restored: {restored.rows} rows and {restored.artifacts} artifacts of {restored.made_at}")


def copy(
    source: Annotated[str, typer.Option("--from", metavar="URL", help="of the database that has the data")],
    target: Annotated[str, typer.Option("--to", metavar="URL", help="of an empty database: SQLite or PostgreSQL")],
    storage_from: Annotated[str | None, typer.Option(help="file:///folder or s3://bucket/prefix of the artifacts")] = None,
    storage_to: Annotated[str | None, typer.Option(help="where the artifacts shall be, if elsewhere")] = None,
) -> None:
    """All data into another database, compared afterwards, and the artifacts that it names into another storage."""
    if (storage_from is None) != (storage_to is None):
        raise Conflict("give both --storage-from and --storage-to, or neither")
    databases = Database(with_driver(source)), Database(with_driver(target))
    with snapshot(databases[0]) as connection:
        if storage_from is not None and storage_to is not None:
            copied = copy_artifacts(named_artifacts(connection), open_artifacts(storage_from), open_artifacts(storage_to))
            typer.echo(f"{copied:8} artifacts")
        counts = copy_rows(connection, databases[1])
    for table, rows in counts.items():
        typer.echo(f"{rows:8} {table}")
    for database in databases:
        database.dispose()


def _require_silence(settings: Settings, database: Database) -> None:
    """Conflict where a worker lives: it would go on with what is no more."""
    living = [
        worker.row
        for worker in standing_workers(database)
        if worker.silent_s <= settings.worker_lease_s and not ProcessName.parse(worker.row.process).is_surely_gone()
    ]
    if living:
        raise Conflict(f"{len(living)} workers run, one of them on {living[0].host}: stop the service first")
