"""What the commands that compute have in common: progress, and an end that leaves no child behind."""

import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from gripwright.cli.options import options_of
from gripwright.design.plan import plan_of, without_effect
from gripwright.jobs.engine import OnProgress
from gripwright.jobs.fork_server import import_first
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import STAGES_AT, Workshop
from gripwright.settings import Settings


@contextmanager
def shown_progress() -> Iterator[OnProgress]:
    """Where to report: a bar on a terminal, else a line a stage. SIGTERM ends the command as Ctrl-C does.

    Standard error stays free for what is wrong with the input, and for what takes long at the first time.
    """
    import_first("gripwright.cli.tells_compiling")
    signal.signal(signal.SIGTERM, _interrupt)
    console = Console()
    if not console.is_terminal:
        yield _Lines(console)
        return
    columns = (
        TextColumn("{task.description:>12}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[message]}"),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=1.0, message="")
        yield lambda fraction, stage, message: bar.update(task, completed=fraction, description=stage, message=message)


def runner_of(settings: Settings, options: Sequence[str], on_progress: OnProgress, stages_at: str = STAGES_AT) -> LocalRunner:
    """A runner with the plan that the `--set` options make; what of it has no effect is said on standard error."""
    plan = plan_of(options_of(options))
    runner = LocalRunner(Workshop.of(settings, stages_at), plan, workers=max(settings.workers, 1), on_progress=on_progress)
    for sentence in without_effect(runner.plan, runner.versions):
        typer.echo(f"warning: {sentence}", err=True)
    return runner


class _Lines:
    """One line when a stage begins."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._stage = ""

    def __call__(self, fraction: float, stage: str, message: str) -> None:
        del message
        if stage != self._stage:
            self._stage = stage
            self._console.print(f"{fraction:4.0%} {stage}", highlight=False)


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt
