"""Media types of the files of a design folder."""

from pathlib import PurePosixPath

_BY_SUFFIX = {
    ".json": "application/json",
    ".csv": "text/csv; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".step": "model/step",
    ".stl": "model/stl",
    ".3mf": "model/3mf",
    ".glb": "model/gltf-binary",
    ".png": "image/png",
    ".urdf": "application/xml",
    ".zip": "application/zip",
    ".xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
}


def media_type_of(path: str) -> str:
    """The media type of a file by its name's ending."""
    return _BY_SUFFIX.get(PurePosixPath(path).suffix.lower(), "application/octet-stream")
