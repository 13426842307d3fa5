"""`gripwright demo`: the sample product through the real service, as an integrator's program would do it."""

import contextlib
import itertools
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from gripwright.cli.serve import LISTENING
from gripwright.samples import write_sample

_SERVE = (sys.executable, "-m", "gripwright.cli", "serve", "--host", "127.0.0.1", "--port", "0")
_START_S = 60.0
_DONE = ("complete", "incomplete")
_COLUMNS = ("gripper", "quantity", "item", "make_or_buy", "maker", "part_number", "description")
_WIDTH = 140  # of the table where no terminal says how wide it is


def demo() -> None:
    """The sample product through the real service: its BOM here, its page in the browser. Stays up until Ctrl-C."""
    console = Console(width=None if sys.stdout.isatty() else _WIDTH)
    with _service() as address, httpx.Client(base_url=address, timeout=_START_S) as client:
        console.print(f"the service is at {address}")
        product = _upload_sample(client)
        console.print(f"product {product['part_number']} revision {product['revision']}: {len(product['components'])} components")
        design = _request_design(client, product["id"])
        _show_progress(client, design["id"], console)
        design = _checked(client.get(f"/api/v1/designs/{design['id']}")).json()
        if design["status"] not in _DONE:
            problem = design["problem"] or {}
            console.print(f"the design has {design['status']}: {problem.get('detail', 'no reason is known')}", style="red")
            raise typer.Exit(1)
        _show_result(client, design, address, console)
        if sys.stdin.isatty() and sys.stdout.isatty():
            console.print("Ctrl-C ends the service")
            with contextlib.suppress(KeyboardInterrupt):
                signal.pause()


@contextlib.contextmanager
def _service() -> Iterator[str]:
    """The address of a service of our own; it ends with the block."""
    process = subprocess.Popen(_SERVE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        assert process.stdout is not None
        assert process.stderr is not None
        log: list[str] = []
        threading.Thread(target=log.extend, args=(process.stderr,), daemon=True).start()
        line = process.stdout.readline()
        if not line.startswith(LISTENING):
            process.wait()
            typer.echo("the service did not start: " + (log[-1].strip() if log else "it left no message"), err=True)
            raise typer.Exit(1)
        yield line.removeprefix(LISTENING).strip()
    finally:
        process.terminate()
        process.wait()


def _checked(answer: httpx.Response) -> httpx.Response:
    """The answer, or the end of the demo with the problem that it holds."""
    if answer.is_error:
        problem = answer.json()
        typer.echo(f"{answer.request.method} {answer.request.url.path}: {problem['detail']}", err=True)
        for fault in problem.get("errors", []):
            typer.echo(f"  {fault['pointer']}: {fault['message']}", err=True)
        raise typer.Exit(1)
    return answer


def _upload_sample(client: httpx.Client) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "sample"
        write_sample(folder)
        archive = Path(shutil.make_archive(str(Path(name) / "package"), "zip", folder))
        with archive.open("rb") as file:
            answer = _checked(client.post("/api/v1/products", files={"package": ("sample.zip", file, "application/zip")}))
    product: dict[str, Any] = answer.json()
    return product


def _request_design(client: httpx.Client, product_id: str) -> dict[str, Any]:
    answer = _checked(client.post(f"/api/v1/products/{product_id}/designs", json={}))
    design: dict[str, Any] = answer.json()
    return design


def _show_progress(client: httpx.Client, job_id: str, console: Console) -> None:
    """Follow the job until it has ended: with a bar on a terminal, else with a line a stage."""
    if not console.is_terminal:
        for stage, states in itertools.groupby(_job_states(client, job_id), key=lambda state: state["progress"]["stage"]):
            console.print(f"{next(states)['progress']['fraction']:4.0%} {stage or 'queued'}")
        return
    columns = (TextColumn("{task.description:<32}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("queued", total=1.0)
        for state in _job_states(client, job_id):
            done = state["progress"]
            description = " ".join(filter(None, (done["stage"], done["message"]))) or state["status"]
            progress.update(task, completed=done["fraction"], description=description[:32])


def _job_states(client: httpx.Client, job_id: str) -> Iterator[dict[str, Any]]:
    """The states of a job as its events tell them."""
    with client.stream("GET", f"/api/v1/jobs/{job_id}/events", timeout=None) as stream:
        for line in stream.iter_lines():
            if line.startswith("data:"):
                yield json.loads(line.removeprefix("data:"))


def _show_result(client: httpx.Client, design: dict[str, Any], address: str, console: Console) -> None:
    items = _checked(client.get(f"/api/v1/designs/{design['id']}/bom")).json()["items"]
    table = Table(title=f"Bill of materials ({design['status']})")
    for name in _COLUMNS:
        table.add_column(name.replace("_", " "), no_wrap=name != "description")
    for item in items:
        table.add_row(*("" if item[name] is None else str(item[name]) for name in _COLUMNS))
    console.print(table)
    for operation in design["design"]["operations"]:
        if operation["status"] != "covered":
            console.print(f"{operation['id']} is not covered: {operation['detail']}", style="yellow")
    console.print("files:")
    for file in design["files"]:
        console.print(f"  {address}{file['href']}", soft_wrap=True)
    console.print(f"report: {address}/api/v1/designs/{design['id']}/files/report.html", soft_wrap=True)
    console.print(f"page:   {address}/", soft_wrap=True)
