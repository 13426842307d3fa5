"""`gripwright clean`."""

from typing import Annotated

import typer

from gripwright.jobs.catalogue import prepared_database
from gripwright.jobs.housekeeping import GRACE_S
from gripwright.jobs.housekeeping import clean as clean_storage
from gripwright.settings import load_settings


def clean(
    grace_hours: Annotated[
        float, typer.Option(min=0.0, help="how long a file may lie unnamed; 0 only while nobody uploads or designs")
    ] = GRACE_S / 3600.0,
) -> None:
    """Remove files that nothing names, and step results beyond their limits. The workers do it themselves once an hour."""
    settings = load_settings()
    database = prepared_database(settings)
    done = clean_storage(settings, database, grace_s=grace_hours * 3600.0)
    database.dispose()
    typer.echo(f"removed: {done.artifacts} artifacts, {done.steps} step results, {done.bytes} bytes; {done.parts} parts of files")
