"""`gripwright actuators`."""

from pathlib import Path
from typing import Annotated

import typer

from gripwright.design.catalogue import why_not
from gripwright.domain.errors import Fault, InvalidInput
from gripwright.jobs.catalogue import catalogue, import_actuators, prepared_database
from gripwright.settings import load_settings

actuators = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@actuators.callback(invoke_without_command=True)
def list_catalogue(context: typer.Context) -> None:
    """The catalogue: maker and model, type, stroke and force as totals, confidence, and why one is not used by itself."""
    if context.invoked_subcommand is not None:
        return
    for actuator in catalogue(load_settings()):
        stroke = "stroke unknown" if actuator.closes else "no jaws"
        stroke = f"{actuator.stroke_mm:g} mm" if actuator.stroke_mm > 0.0 else stroke
        force = "force unknown" if actuator.grip_force_N is None else f"{actuator.grip_force_N:g} N"
        reason = why_not(actuator)
        told = f"  {reason.code}" + (f" ({actuator.note})" if actuator.note else "") if reason is not None else ""
        typer.echo(f"{actuator.name}  {actuator.gripper_type}  {stroke}  {force}  {actuator.confidence}{told}")


@actuators.command("import")
def import_file(
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help="columns as docs/api.md says")],
    dry_run: Annotated[bool, typer.Option(help="say what would be done, and do nothing")] = False,
) -> None:
    """Add the actuators of a CSV, or replace those that are there: all or, where a row cannot be read, none."""
    from gripwright.store.columns import utc_now

    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInput("the actuators cannot be read", faults=(Fault(str(file), str(error)),)) from None
    database = prepared_database(load_settings())
    with database.write_sessions.begin() as session:
        done = import_actuators(session, text, utc_now(), dry_run=dry_run)
    database.dispose()
    for actuator, outcome in done.actuators:
        typer.echo(f"{outcome}: {actuator.name}")
    for fault in done.faults:
        typer.echo(f"{fault.pointer}: {fault.message}", err=True)
    if done.faults:
        raise typer.Exit(1)
