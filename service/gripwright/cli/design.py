"""`gripwright design`."""

import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from gripwright.cad.limits import DEFAULT_LIMITS
from gripwright.cad.package import read_package
from gripwright.cli.options import OWNED_HELP, SET_HELP, owned_setting
from gripwright.cli.run import runner_of, shown_progress
from gripwright.design import pipeline
from gripwright.domain.errors import Fault, InvalidInput
from gripwright.jobs.catalogue import catalogue
from gripwright.jobs.child import preload
from gripwright.settings import load_settings

INCOMPLETE = 3
DOCUMENT = "design.json"


def design(
    product: Annotated[Path, typer.Argument(help="a folder or .zip with product.json and its CAD files, or a STEP assembly")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="the design folder; an earlier design in it is replaced")],
    options: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help=SET_HELP)] = None,
    operations: Annotated[Path | None, typer.Option(help="the assembly sequence, instead of the package's own")] = None,
    owned: Annotated[Path | None, typer.Option(metavar="FILE", help=OWNED_HELP)] = None,
) -> None:
    """The whole job: from a product package to its grippers.

    Exit code 0: complete, 1: the input is refused, 3: some component has no feasible gripper (the design says why).
    """
    _require_place(out)
    options = [*(options or []), *(owned_setting(owned) if owned is not None else [])]
    settings = load_settings()
    with shown_progress() as show:
        show(0.0, "read", str(product))
        if product.exists():
            preload()  # while the package is read
        task = read_package(product, DEFAULT_LIMITS, operations)
        runner = runner_of(settings, options, show)
        result = pipeline.design(task, catalogue(settings), runner.plan, runner)
        (folder,) = runner.map("export", [{"result": {"ref": result}}])
        files = runner.get(folder)
    write_folder(out, files)
    document = json.loads(files[DOCUMENT])
    _summarise(document, out)
    if document["status"] != "complete":
        raise typer.Exit(INCOMPLETE)


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
    typer.echo(f"{document['status']}: {len(grippers)} grippers, in {folder}")
    for gripper in grippers:
        opening = f"{gripper['opening_min']:g} to {gripper['opening_max']:g} mm"
        actuator = f"{gripper['actuator']['maker']} {gripper['actuator']['model']}"
        actuator = f"{gripper['owned']} (at hand)" if gripper["owned"] else actuator
        held = ", ".join(dict.fromkeys(handle["component"] for handle in gripper["handles"]))
        typer.echo(
            f"  {gripper['id']}: {gripper['fingers']} fingers of {gripper['finger_length']:g} mm, {opening}, {actuator}: {held}"
        )
    for operation in document["operations"]:
        if operation["status"] != "covered":
            typer.echo(f"  {operation['id']} is {operation['status']}: {operation['detail']}")
