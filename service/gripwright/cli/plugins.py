"""`gripwright plugins`: what is installed, whether it keeps the contract, and the start of a new one."""

import importlib.metadata
import json
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from gripwright.cli.plugin_check import findings_in_children
from gripwright.cli.plugin_project import write_project
from gripwright.domain.errors import NotFound
from gripwright.plugin_api.manifest import KINDS
from gripwright.registry.description import FailureDescription, PluginDescription, RegistryDescription, describe_in_child
from gripwright.registry.plans import plan_schema
from gripwright.settings import load_settings

GUIDE = "docs/plugins/README.md of Gripwright's repository"

plugins = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@plugins.callback(invoke_without_command=True)
def list_installed(
    context: typer.Context,
    as_json: Annotated[bool, typer.Option("--json", help="all that is known, with JSON Schemas of all options")] = False,
) -> None:
    """What is installed: kind, name, version, where from, what is deprecated in it, and what could not be loaded."""
    if context.invoked_subcommand is not None:
        return
    description = describe_in_child(allow=load_settings().plugins_allow)
    if as_json:
        typer.echo(json.dumps({**description, "plan": plan_schema()}, indent=2, ensure_ascii=False))
        return
    rows = [(plugin["kind"], plugin["key"], plugin["version"], plugin["distribution"]) for plugin in description["plugins"]]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        typer.echo("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())
    for text in dict.fromkeys(
        f"deprecated: {plugin['distribution']}: {warning}" for plugin in description["plugins"] for warning in plugin["warnings"]
    ):
        typer.echo(text, err=True)
    for failure in description["failures"]:
        typer.echo(_not_loaded(failure), err=True)


@plugins.command()
def check(
    key: Annotated[str | None, typer.Argument(metavar="[KEY]", help="a key or KIND/KEY; without it, all")] = None,
    time_limit: Annotated[float, typer.Option(min=0.1, max=86_400.0, help="s, of one check")] = 120.0,
) -> None:
    """Run the conformance suite on what is installed. Exit code 1 where anything fails."""
    allow = load_settings().plugins_allow
    description = describe_in_child(allow=allow)
    names, failures = _chosen(description, key)
    broken = len(failures)
    for failure in failures:
        typer.echo(_not_loaded(failure))
    for name, findings in findings_in_children(names, allow, time_limit):
        broken += bool(findings)
        typer.echo(f"{name}: {'fails' if findings else 'passes'}")
        for finding in findings:
            typer.echo(f"  {finding}")
    for note in _other_versions(description["plugins"], names):
        typer.echo(note, err=True)
    if broken:
        raise typer.Exit(1)


@plugins.command()
def new(
    name: Annotated[str, typer.Argument(help="lower case letters, digits and _; becomes the plug-in's key")],
    kind: Annotated[list[str], typer.Option(help=f"{', '.join(KINDS)}; fitter and rule may be begun together")],
    out: Annotated[Path, typer.Option(help="the folder in which the project's folder is made")] = Path(),
) -> None:
    """Begin a plug-in: a project with code, tests and CI that passes its own tests at once."""
    folder, keys = write_project(name, kind, out)
    typer.echo(f"{folder}: install it with `python -m pip install -e {folder}`, test it with `python -m pytest {folder}`")
    typer.echo(f"what is installed is checked by {' and '.join(f'`gripwright plugins check {key}`' for key in keys)}")
    typer.echo(f"how to go on: {GUIDE}")


def _chosen(description: RegistryDescription, key: str | None) -> tuple[list[str], list[FailureDescription]]:
    """Names and load failures that a key stands for; NotFound where it stands for none."""
    names = [f"{plugin['kind']}/{plugin['key']}" for plugin in description["plugins"]]
    failures = description["failures"]
    if key is None:
        return names, failures
    chosen = [name for name in names if key in (name, name.partition("/")[2])]
    failed = [failure for failure in failures if key in (failure["plugin"], failure["plugin"].partition("/")[2])]
    if not chosen and not failed:
        raise NotFound(f"no plug-in {key!r} is installed; there are {', '.join(names)}")
    return chosen, failed


def _other_versions(plugins: Sequence[PluginDescription], names: Collection[str]) -> Iterator[str]:
    """A sentence for each distribution of the named plug-ins whose version is another than its manifest's."""
    stated = {one["distribution"]: one["version"] for one in plugins if f"{one['kind']}/{one['key']}" in names}
    for distribution, version in stated.items():
        with suppress(importlib.metadata.PackageNotFoundError):
            if (packaged := importlib.metadata.version(distribution)) != version:
                yield f"note: {distribution} is {packaged}, its manifest says {version}: this is shown, and stored with results"


def _not_loaded(failure: FailureDescription) -> str:
    return f"not loaded: {failure['plugin']} of {failure['distribution']}: {failure['reason']}"
