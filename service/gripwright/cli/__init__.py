"""The command line. A command's module is imported when it is called, so that `gripwright --help` answers at once."""

import importlib
import sys
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from gripwright.domain.errors import GripwrightError

COMMANDS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "design": ("gripwright.cli.design", "The whole job: from a product package to its grippers."),
        "analyse": ("gripwright.cli.analyse", "One component: its segments and the primitives fitted to them."),
        "minimise": ("gripwright.cli.minimise", "The gripper-set optimisation alone."),
        "serve": ("gripwright.cli.serve", "The HTTP service with its embedded workers."),
        "worker": ("gripwright.cli.serve", "A further worker process."),
        "workers": ("gripwright.cli.workers", "The worker processes of all hosts: live or stale, and what they run."),
        "migrate": ("gripwright.cli.serve", "Bring the database to this version."),
        "backup": ("gripwright.cli.backup", "Database and artifacts into a folder, while the service runs."),
        "restore": ("gripwright.cli.backup", "A backup into an empty database, or with --force instead of what is there."),
        "copy": ("gripwright.cli.backup", "All data into another database: SQLite to PostgreSQL, or back."),
        "clean": ("gripwright.cli.clean", "Remove files that nothing names, and step results that nobody used for long."),
        "demo": ("gripwright.cli.demo", "The sample product through the real service."),
        "sample": ("gripwright.cli.sample", "Write the sample product as a package."),
        "plugins": ("gripwright.cli.plugins", "What is installed; check it, or begin a new plug-in."),
        "actuators": ("gripwright.cli.actuators", "The catalogue; import actuators of your own from a CSV."),
        "keys": ("gripwright.cli.keys", "API keys of the HTTP service: create, list, rotate, revoke."),
        "audit": ("gripwright.cli.audit", "Who did what over HTTP, the newest first."),
        "openapi": ("gripwright.cli.openapi", "The OpenAPI document on standard output."),
    }
)
"""Name → (module that has a function or a Typer of that name, one line of help)."""

REFUSED, BROKEN, STOPPED = 1, 70, 130
"""Exit codes beside 0: the input is refused, the software or a plug-in broke, somebody stopped it."""

_BROKEN_CODES = ("step-failure", "plugin-failure", "internal")


class _Deferred(TyperCommand):
    """A command known by its help line until it is called."""

    def __init__(self, name: str) -> None:
        self._module, line = COMMANDS[name]
        super().__init__(name, help=line, short_help=line)

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        assert self.name is not None
        command = getattr(importlib.import_module(self._module), self.name)
        if not isinstance(command, typer.Typer):
            function, command = command, typer.Typer(add_completion=False, pretty_exceptions_enable=False)
            command.command(name=self.name)(function)
        return get_command(command).make_context(info_name, args, parent, **extra)


class _Commands(TyperGroup):
    """The commands, and the one place where an error becomes a line on standard error and an exit code."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> TyperCommand | None:
        return _Deferred(cmd_name) if cmd_name in COMMANDS else None

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            sys.stderr.write("stopped\n")
            raise typer.Exit(STOPPED) from error
        except GripwrightError as error:
            lines = [f"{fault.pointer}: {fault.message}" for fault in error.faults] or [error.detail]
            sys.stderr.write("\n".join(lines) + "\n")
            raise typer.Exit(BROKEN if error.code in _BROKEN_CODES else REFUSED) from error


app = typer.Typer(cls=_Commands, add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False)


@app.callback()
def main() -> None:
    """The smallest set of robot grippers that can assemble a product."""
