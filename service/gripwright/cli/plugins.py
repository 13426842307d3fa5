"""`gripwright plugins`."""

import typer

from gripwright.registry.description import describe_in_child
from gripwright.settings import load_settings


def plugins() -> None:
    """What is installed: kind, name, version, where from, and what could not be loaded."""
    settings = load_settings()
    description = describe_in_child(allow=settings.plugins_allow)
    rows = [(plugin["kind"], plugin["key"], plugin["version"], plugin["distribution"]) for plugin in description["plugins"]]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        typer.echo("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())
    for failure in description["failures"]:
        typer.echo(f"not loaded: {failure['plugin']} of {failure['distribution']}: {failure['reason']}", err=True)
