"""`gripwright analyse`."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from gripwright.cad.formats import EXTENSIONS, format_of
from gripwright.cad.reader import CadReader
from gripwright.cli.options import SET_HELP
from gripwright.cli.run import runner_of, shown_progress
from gripwright.design.analysis import analyse as analyse_meshes
from gripwright.domain.errors import Fault, InvalidInput, Rejection
from gripwright.domain.shape import Mesh
from gripwright.jobs.fork_server import preload
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import ANALYSIS_STAGES_AT
from gripwright.settings import load_settings


def analyse(
    mesh: Annotated[Path, typer.Argument(help=f"a CAD file: {' '.join(EXTENSIONS)}")],
    units: Annotated[str | None, typer.Option(help="mm, cm, m or in, where the file does not say")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="segments, primitives and timings")] = None,
    labels_file: Annotated[
        Path | None, typer.Option("--labels", metavar="FILE", help="one segment number a face, a line each, in the file's order")
    ] = None,
    options: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help=SET_HELP)] = None,
) -> None:
    """One component: its segments and the primitives fitted to them."""
    with shown_progress() as show:
        show(0.0, "read", str(mesh))
        if mesh.exists():
            preload()  # while the file is read
        shape = _read(mesh, units)
        analysis = _analysis(shape, runner_of(load_settings(), options or [], show, ANALYSIS_STAGES_AT))
    labels = analysis.pop("labels")
    if labels_file is not None:
        _write(labels_file, "".join(f"{label}\n" for label in labels))
    if json_file is not None:
        _write(json_file, json.dumps(analysis, indent=1))
    for segment in analysis["segments"]:
        kind = segment["primitive"]["kind"] if segment["primitive"] is not None else "no primitive"
        typer.echo(f"segment {segment['id']}: {segment['faces']} faces, {segment['area']:.1f} mm², {kind}: {segment['reason']}")
    for remark in analysis["remarks"]:
        typer.echo(remark)
    for warning in analysis["warnings"]:
        typer.echo(f"warning: {warning}", err=True)


def _read(path: Path, units: str | None) -> Mesh:
    format = format_of(path.name)
    if format is None:
        fault = Fault(str(path), f"is no CAD file that is read: {' '.join(EXTENSIONS)}")
        raise InvalidInput("the component cannot be read", faults=(fault,))
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InvalidInput("the component cannot be read", faults=(Fault(str(path), error.strerror or str(error)),)) from None
    with CadReader(load_settings().package_limits) as reader:
        return reader.mesh(path.name, data, format, units)


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidInput("the answer cannot be written", faults=(Fault(str(path), error.strerror or str(error)),)) from None


def _analysis(mesh: Mesh, runner: LocalRunner) -> dict[str, Any]:
    ref = runner.put(mesh)
    answer = analyse_meshes([ref], runner.plan, runner)[ref].analysis
    if isinstance(answer, Rejection):
        raise InvalidInput("the segmenter does not do for the component", faults=(Fault("--set segmenter", answer.detail),))
    (described,) = runner.map("describe", [{"analysis": {"ref": answer}}])
    analysis: dict[str, Any] = runner.get(described)
    return analysis
