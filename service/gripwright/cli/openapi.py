"""`gripwright openapi`."""

import json
import tempfile
from pathlib import Path
from typing import Any

import typer

from gripwright.http.app import create_app
from gripwright.settings import Settings


def openapi() -> None:
    """The OpenAPI document on standard output."""
    typer.echo(json.dumps(openapi_document(), indent=2))


def openapi_document() -> dict[str, Any]:
    """The OpenAPI document of this version; nothing is started or stored."""
    return create_app(Settings(data_dir=Path(tempfile.gettempdir()))).openapi()
