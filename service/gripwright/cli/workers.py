"""`gripwright workers`."""

from typing import Annotated

import typer

from gripwright.http.schemas.workers import WorkerView
from gripwright.jobs.catalogue import prepared_database
from gripwright.settings import load_settings
from gripwright.store.workers import WorkerRepository


def workers(json_lines: Annotated[bool, typer.Option("--json", help="a JSON object a line")] = False) -> None:
    """Every worker process: id, host, number of its process, version, live or stale, steps, when it was last heard of."""
    settings = load_settings()
    database = prepared_database(settings)
    with database.read_sessions() as session:
        views = [WorkerView.of(worker, settings.worker_lease_s) for worker in WorkerRepository(session).all()]
    database.dispose()
    for view in views:
        typer.echo(view.model_dump_json() if json_lines else _line(view))


def _line(view: WorkerView) -> str:
    heard = f"{view.heartbeat_at:%Y-%m-%dT%H:%M:%SZ}"
    return f"{view.id}  {view.host}  {view.pid}  {view.version}  {view.state}  {view.steps} steps  {heard}"
