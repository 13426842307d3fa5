"""`gripwright minimise`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from gripwright.domain.errors import Fault, InvalidInput
from gripwright.jobs.gripper_sets import solve_document


def minimise(
    constraints: Annotated[Path, typer.Argument(metavar="CONSTRAINTS.json", help="a gripper-set problem")],
    timeout: Annotated[float, typer.Option(min=0.1, help="seconds after which the optimisation is given up")] = 600.0,
) -> None:
    """The gripper-set optimisation alone: the smallest set that holds every component, as JSON on standard output."""
    try:
        document = json.loads(constraints.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput("the constraints cannot be read", faults=(Fault(str(constraints), str(error)),)) from None
    typer.echo(json.dumps(solve_document(document, timeout_s=timeout), indent=2))
