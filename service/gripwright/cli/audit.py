"""`gripwright audit`."""

from typing import Annotated

import typer

from gripwright.http.schemas.audit import AuditView
from gripwright.jobs.catalogue import prepared_database
from gripwright.settings import load_settings
from gripwright.store.audit import AuditRepository


def audit(
    limit: Annotated[int, typer.Option(min=1, max=1_000_000, help="rows at most")] = 50,
    actor: Annotated[str | None, typer.Option(help="as in the third column")] = None,
    resource: Annotated[str | None, typer.Option(help="id of a product, a design, a key …")] = None,
    json_lines: Annotated[bool, typer.Option("--json", help="a JSON object a line")] = False,
) -> None:
    """Who did what over HTTP, the newest first: when, id of the request, who, what, status, id of the resource."""
    settings = load_settings()
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    database = prepared_database(settings)
    with database.read_sessions() as session:
        rows = AuditRepository(session).page(after=None, limit=limit, actor=actor, resource_id=resource)
        views = [AuditView.of(row) for row in rows]
    database.dispose()
    for view in views:
        typer.echo(view.model_dump_json() if json_lines else _line(view))


def _line(view: AuditView) -> str:
    who = f"{view.actor} ({view.actor_name})" if view.actor_name else view.actor or "refused"
    cells = (f"{view.at:%Y-%m-%dT%H:%M:%SZ}", view.request_id or "-", who, view.client or "-", view.method, view.path)
    return "  ".join((*cells, str(view.status), view.resource_id))
