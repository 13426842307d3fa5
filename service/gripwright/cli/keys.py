"""`gripwright keys`: API keys are made, listed, rotated and revoked."""

import getpass
import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import Annotated

import typer
from sqlalchemy.orm import Session

from gripwright.domain.access import AccessScope
from gripwright.jobs.catalogue import prepared_database
from gripwright.jobs.keys import NewKey, create_key, revoke_keys, rotate_key
from gripwright.settings import load_settings
from gripwright.store.api_keys import ApiKeyRepository, is_valid
from gripwright.store.columns import utc_now

keys = typer.Typer(add_completion=False, pretty_exceptions_enable=False, no_args_is_help=True)

_DAYS_MAX = 3650
IdOrName = Annotated[str, typer.Argument(metavar="ID|NAME", help="as `list` shows them")]
Days = Annotated[int, typer.Option(min=1, max=_DAYS_MAX, help="until the new key expires")]


@keys.command()
def create(
    name: Annotated[str, typer.Argument(help="who or what will use it")],
    scope: Annotated[AccessScope, typer.Option(help="write includes read, admin includes both")] = AccessScope.READ,
    days: Days = 365,
) -> None:
    """Make a key. It is printed on standard output this once, and stored nowhere."""
    with _session() as session:
        made = create_key(session, name, scope, timedelta(days=days), utc_now(), actor=_actor())
    _print_once(made)


@keys.command("list")
def list_keys() -> None:
    """Every key: id, name, scope, when it was made, until when it is valid."""
    now = utc_now()
    with _session() as session:
        for row in ApiKeyRepository(session).all():
            end = row.expires_at if row.revoked_at is None else row.revoked_at
            state = "valid until" if is_valid(row, now) else "expired" if row.revoked_at is None else "revoked"
            typer.echo(f"{row.id}  {row.name}  {row.scope}  made {row.created_at:%Y-%m-%d}  {state} {end:%Y-%m-%d %H:%M} UTC")


@keys.command()
def rotate(
    key: IdOrName,
    days: Days = 365,
    overlap: Annotated[
        float, typer.Option(min=0.0, max=24.0 * _DAYS_MAX, help="hours for which the old key is valid still")
    ] = 24.0,
) -> None:
    """Make a new key of the same name and scope; the old one ends after the overlap."""
    with _session() as session:
        made = rotate_key(session, key, timedelta(days=days), timedelta(hours=overlap), utc_now(), actor=_actor())
    _print_once(made)


@keys.command()
def revoke(key: IdOrName) -> None:
    """End a key at once; of a name, every valid key."""
    with _session() as session:
        for row in revoke_keys(session, key, utc_now(), actor=_actor()):
            typer.echo(f"revoked: {row.id}  {row.name}")


@contextmanager
def _session() -> Iterator[Session]:
    """One command, one transaction."""
    settings = load_settings()
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    database = prepared_database(settings)
    with database.write_sessions.begin() as session:
        yield session
    database.dispose()


def _print_once(made: NewKey) -> None:
    """The key alone on standard output, so that a script can take it."""
    row = made.row
    typer.echo(f"{row.id}  {row.name}  {row.scope}  valid until {row.expires_at:%Y-%m-%d %H:%M} UTC", err=True)
    typer.echo("the key, shown this once:", err=True)
    typer.echo(made.word)


def _actor() -> str:
    """Who runs the command, as the audit trail names them."""
    try:
        return f"cli:{getpass.getuser()}"
    except (KeyError, OSError):  # a container's user need not have a name
        return f"cli:{os.getuid()}"
