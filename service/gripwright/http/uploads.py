"""Multipart uploads of products, written to a folder of their own for the time of the request."""

import os
import shutil
import tempfile
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from fastapi import Depends, Request
from pydantic_core import PydanticCustomError
from starlette.datastructures import FormData, UploadFile

from gripwright.cad.formats import format_of
from gripwright.cad.manifest import check_file_name
from gripwright.cad.package import DOCUMENT
from gripwright.domain.errors import Fault, InvalidInput
from gripwright.http.deps import Service
from gripwright.http.errors import UnsupportedMediaType

_NAME_BYTES = 255  # as file systems have it
_PATH_CHARACTERS = 500  # as product.json has it

UPLOAD_SCHEMA: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "properties": {
                        "package": {
                            "type": "string",
                            "format": "binary",
                            "description": "a .zip with product.json and its CAD files, or one STEP assembly alone",
                        },
                        "manifest": {"type": "string", "description": "product.json, where the CAD files are parts of their own"},
                        "files": {
                            "type": "array",
                            "items": {"type": "string", "format": "binary"},
                            "description": "the CAD files that the manifest names, by their file names",
                        },
                    },
                }
            }
        },
    }
}

IMPORT_SCHEMA: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["package"],
                    "properties": {
                        "package": {
                            "type": "array",
                            "items": {"type": "string", "format": "binary"},
                            "description": "packages (.zip), STEP assemblies, and archives (.zip) that hold such",
                        }
                    },
                }
            }
        },
    }
}


@dataclass(frozen=True, slots=True)
class Upload:
    """The parts of an upload: file parts, and the manifest where it is a part of its own."""

    files: tuple[UploadFile, ...]
    manifest: str | UploadFile | None


async def upload_parts(request: Request, service: Service) -> AsyncIterator[Upload]:
    """The parts as they arrived, large ones on disk; closed when the request is over."""
    if not request.headers.get("content-type", "").lower().startswith("multipart/form-data"):
        raise UnsupportedMediaType("an upload is multipart/form-data")
    settings = service.settings
    form = await request.form(
        max_files=settings.upload_max_files, max_fields=settings.upload_max_files, max_part_size=settings.body_max_bytes
    )
    try:
        yield _parts(form)
    finally:
        await form.close()


UploadParts = Annotated[Upload, Depends(upload_parts)]


def _parts(form: FormData) -> Upload:
    files: list[UploadFile] = []
    manifest: str | UploadFile | None = None
    for name, part in form.multi_items():
        if name == "manifest":
            if manifest is not None:
                raise InvalidInput("the upload has two manifests", faults=(Fault("manifest", "given twice"),))
            manifest = part
        elif isinstance(part, UploadFile):
            files.append(part)
        else:
            raise InvalidInput("the upload has a field that is no file", faults=(Fault(name, "not a file part"),))
    return Upload(files=tuple(files), manifest=manifest)


@contextmanager
def stored_upload(upload: Upload) -> Iterator[Path]:
    """The upload as a path that `read_product` takes, gone afterwards: an archive, a STEP file, or a folder."""
    with tempfile.TemporaryDirectory(prefix="gripwright-upload-") as name:
        folder = Path(name)
        if upload.manifest is None:
            yield _write_single(folder, upload.files)
        else:
            yield _write_folder(folder, upload.manifest, upload.files)


def _write_single(folder: Path, files: tuple[UploadFile, ...]) -> Path:
    """An archive or a STEP assembly that stands alone."""
    if len(files) != 1:
        raise InvalidInput(
            "the upload is no product",
            faults=(Fault("manifest", f"{len(files)} files and no manifest part; a .zip or a STEP assembly may stand alone"),),
        )
    target = package_path(folder, Path(files[0].filename or "").name)
    _write(target, files[0])
    return target


def package_path(folder: Path, name: str) -> Path:
    """Where a package of that name is written; InvalidInput where it is neither an archive nor a STEP assembly."""
    if format_of(name) == "step":
        return folder / _file_name(name)
    if name.lower().endswith(".zip"):
        return folder / "package.zip"
    fault = Fault(name or "package", "neither a .zip nor a STEP assembly (.step, .stp)")
    raise InvalidInput("the upload is no product", faults=(fault,))


def _write_folder(folder: Path, manifest: str | UploadFile, files: tuple[UploadFile, ...]) -> Path:
    """A package of parts: the manifest as product.json, and each CAD file under its own name."""
    if isinstance(manifest, str):
        (folder / DOCUMENT).write_bytes(manifest.encode())
    else:
        _write(folder / DOCUMENT, manifest)
    faults: list[Fault] = []
    for part in files:
        name = part.filename or ""
        try:
            target = folder / _file_name(name)
        except InvalidInput as error:
            faults += error.faults
            continue
        if target.exists() or not _make_folder(target.parent):
            faults.append(Fault(name, "given twice, or beside a file of the name of its folder"))
            continue
        _write(target, part)
    if faults:
        raise InvalidInput("the upload has files that cannot be used", faults=tuple(faults))
    return folder


def _file_name(name: str) -> str:
    """A name that a file can have; InvalidInput otherwise."""
    try:
        checked = check_file_name(name)
    except PydanticCustomError as error:
        raise InvalidInput("the upload is no product", faults=(Fault(name or "files", error.message()),)) from None
    longest = max(len(os.fsencode(part)) for part in checked.split("/"))
    if longest > _NAME_BYTES or len(checked) > _PATH_CHARACTERS:
        sizes = f"a name of {longest} bytes in a path of {len(checked)} characters"
        message = f"{sizes}, at most {_NAME_BYTES} and {_PATH_CHARACTERS}"
        raise InvalidInput("the upload is no product", faults=(Fault(name, message),))
    return checked


def _make_folder(folder: Path) -> bool:
    """Whether there is such a folder now; a file of that name may be in the way."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        return False
    return True


def _write(target: Path, part: UploadFile) -> None:
    with target.open("wb") as file:
        shutil.copyfileobj(part.file, file)
