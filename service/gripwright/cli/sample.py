"""`gripwright sample`."""

from pathlib import Path
from typing import Annotated

import typer

from gripwright.samples import write_sample


def sample(folder: Annotated[Path, typer.Argument(metavar="DIR", help="is made where it does not exist")]) -> None:
    """Write the sample product as a package: product.json and its CAD files."""
    write_sample(folder)
    typer.echo(f"the sample product is in {folder}")
