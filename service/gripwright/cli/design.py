"""`gripwright design`."""

import dataclasses
import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from gripwright.cad.operations import operations_document
from gripwright.cad.package import read_package
from gripwright.cli.options import OWNED_HELP, SET_HELP, owned_setting
from gripwright.cli.run import runner_of, shown_progress
from gripwright.design import pipeline
from gripwright.domain.assembly import AssemblyTask
from gripwright.domain.errors import Fault, InvalidInput, Rejection
from gripwright.domain.grasp import SURFACE
from gripwright.jobs.catalogue import catalogue
from gripwright.jobs.fork_server import preload
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import SEQUENCE_STAGES_AT
from gripwright.settings import load_settings

INCOMPLETE = 3
DOCUMENT, SEQUENCE = "design.json", "operations.json"


def design(
    product: Annotated[Path, typer.Argument(help="a folder or .zip with product.json and its CAD files, or a STEP assembly")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="the design folder; an earlier design in it is replaced")],
    options: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help=SET_HELP)] = None,
    operations: Annotated[Path | None, typer.Option(help="the assembly sequence, instead of the package's own")] = None,
    propose_sequence: Annotated[bool, typer.Option(help="propose the assembly sequence, straight motions")] = False,
    owned: Annotated[Path | None, typer.Option(metavar="FILE", help=OWNED_HELP)] = None,
) -> None:
    """The whole job: from a product package to its grippers.

    Exit code 0: complete, 1: the input is refused, 3: some component has no feasible gripper (the design says why).
    """
    _require_place(out)
    if propose_sequence and operations is not None:
        fault = Fault("--propose-sequence", "excludes --operations: the sequence is given or proposed")
        raise InvalidInput("two assembly sequences", faults=(fault,))
    options = [*(options or []), *(owned_setting(owned) if owned is not None else [])]
    settings = load_settings()
    with shown_progress() as show:
        show(0.0, "read", str(product))
        if product.exists():
            preload()  # while the package is read
        task = read_package(product, settings.package_limits, operations)
        proposal: dict[str, bytes] = {}
        if propose_sequence:
            task = _with_proposed_sequence(task, runner_of(settings, options, show, SEQUENCE_STAGES_AT))
            proposal[SEQUENCE] = json.dumps(operations_document(task.operations), indent=1).encode()
        runner = runner_of(settings, options, show)
        result = pipeline.design(task, catalogue(settings), runner.plan, runner)
        (folder,) = runner.map("export", [{"result": {"ref": result}}])
        files = runner.get(folder)
    write_folder(out, {**files, **proposal})
    document = json.loads(files[DOCUMENT])
    _summarise(document, out)
    if document["status"] != "complete":
        raise typer.Exit(INCOMPLETE)


def _with_proposed_sequence(task: AssemblyTask, runner: LocalRunner) -> AssemblyTask:
    """The task with a sequence made from its finished product, in place of its own; InvalidInput where there is none."""
    meshes = [{"mesh": {"ref": runner.put(component.mesh)}} for component in task.components]
    prepared = runner.map("prepare", meshes)
    components = [
        {"component": {"ref": runner.put(pipeline.without_mesh(component))}, "prepared": {"ref": ref}}
        for component, ref in zip(task.components, prepared, strict=True)
    ]
    (proposed,) = runner.map("propose", [{"components": components}])
    answer = runner.get(proposed)
    if isinstance(answer, Rejection):
        raise InvalidInput("no assembly sequence can be proposed", faults=(Fault("--propose-sequence", answer.detail),))
    return dataclasses.replace(task, operations=answer)


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write a design folder whole or not at all, in place of an earlier one."""
    folder = folder.absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    made = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    try:
        for name, data in files.items():
            path = made / "new" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        if folder.exists():
            os.rename(folder, made / "old")
        os.rename(made / "new", folder)
    finally:
        shutil.rmtree(made)


def _require_place(folder: Path) -> None:
    """InvalidInput where writing a design would destroy something else."""
    if not folder.exists() or (folder / DOCUMENT).is_file() or (folder.is_dir() and not any(folder.iterdir())):
        return
    fault = Fault(pointer="--out", message=f"{folder} exists and is not a design folder")
    raise InvalidInput("there is no place for the design folder", faults=(fault,))


def _summarise(document: Mapping[str, Any], folder: Path) -> None:
    grippers = document["grippers"]
    typer.echo(f"{document['status']}: {len(grippers)} gripper{'s' * (len(grippers) != 1)}, in {folder}")
    for gripper in grippers:
        held_by = f"{gripper['fingers']} fingers of {gripper['finger_length']:g} mm"
        opening = f"{gripper['opening_min']:.4g} to {gripper['opening_max']:.4g} mm"
        if gripper["grip"] == SURFACE:
            held_by, opening = f"a face {gripper['finger_length']:g} mm before the palm", f"⌀{gripper['opening_max']:.4g} mm"
        actuator = f"{gripper['actuator']['maker']} {gripper['actuator']['model']}"
        actuator = f"{gripper['owned']} (at hand)" if gripper["owned"] else actuator
        held = ", ".join(dict.fromkeys(handle["component"] for handle in gripper["handles"]))
        typer.echo(f"  {gripper['id']}: {held_by}, {opening}, {actuator}: {held}")
    for operation in document["operations"]:
        if operation["status"] != "covered":
            typer.echo(f"  {operation['id']} is {operation['status']}: {operation['detail']}")
