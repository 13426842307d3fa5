"""The CAD formats that are read, by file name extension. Imports no mesh library."""

from collections.abc import Mapping
from pathlib import PurePosixPath
from types import MappingProxyType

_FORMATS: Mapping[str, str] = MappingProxyType(
    {
        ".stl": "stl",
        ".obj": "obj",
        ".ply": "ply",
        ".off": "off",
        ".3mf": "3mf",
        ".glb": "glb",
        ".step": "step",
        ".stp": "step",
    }
)
EXTENSIONS: tuple[str, ...] = tuple(_FORMATS)
STATES_UNITS: frozenset[str] = frozenset({"3mf", "step", "glb"})  # formats whose files say what their numbers mean


def format_of(name: str) -> str | None:
    """The format of a file of that name, None where it is none that is read."""
    return _FORMATS.get(PurePosixPath(name).suffix.lower())
