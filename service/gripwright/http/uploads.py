"""Multipart uploads of products. Their parts are read from where the request left them; no file takes a name from outside."""

from collections.abc import AsyncIterator
from pathlib import PurePosixPath
from typing import Annotated, Any

from fastapi import Depends, Request
from pydantic_core import PydanticCustomError
from python_multipart.multipart import parse_options_header
from starlette.datastructures import FormData, UploadFile
from starlette.exceptions import HTTPException
from starlette.formparsers import MultiPartException, MultiPartParser
from starlette.requests import ClientDisconnect

from gripwright.cad.archive import check_size
from gripwright.cad.limits import Limits
from gripwright.cad.manifest import check_file_name
from gripwright.cad.package import DOCUMENT
from gripwright.domain.errors import Fault, InvalidInput
from gripwright.http.deps import Service
from gripwright.http.errors import UnsupportedMediaType

UPLOAD_SCHEMA: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "additionalProperties": False,
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
                    "additionalProperties": False,
                    "properties": {
                        "package": {
                            "type": "array",
                            "minItems": 1,
                            "items": {"type": "string", "format": "binary"},
                            "description": "packages (.zip), STEP assemblies, and archives (.zip) that hold such",
                        }
                    },
                }
            }
        },
    }
}


_FIELDS = 2  # the manifest, and one too many to be told about
_SHOWN = 200  # characters of a name
_NAME_MAX = 500
_CHARSETS = ("utf-8", "utf8", "us-ascii")


class UploadedFiles:
    """The parts of an upload as the files of a package, by their names; the manifest is product.json."""

    def __init__(self, parts: dict[str, UploadFile | bytes], limits: Limits) -> None:
        self._parts, self._limits, self._total = parts, limits, 0
        self.names = frozenset(parts)

    @property
    def in_order(self) -> tuple[str, ...]:
        """The names as they came."""
        return tuple(self._parts)

    @property
    def label(self) -> str:
        """What to call the upload: the name of the file that it is, or of its document."""
        return DOCUMENT if DOCUMENT in self._parts else next(iter(self._parts), "the upload")

    def read(self, name: str) -> bytes:
        """The content of a file."""
        part = self._parts[name]
        size = len(part) if isinstance(part, bytes) else part.size or 0
        self._total += size
        check_size(name, size, self._total, self._limits)
        return part if isinstance(part, bytes) else part.file.read()


class _Parser(MultiPartParser):
    """Knows whether the body came to its end: the framework takes what has come for all."""

    ended = False

    def on_end(self) -> None:
        """The closing boundary."""
        self.ended = True


async def uploaded_files(request: Request, service: Service) -> AsyncIterator[UploadedFiles]:
    """The parts as they arrived, large ones on disk; gone when the answer is made."""
    form = await _form(request, service)
    try:
        yield _files(form, service.package_limits)
    finally:
        await form.close()


UploadFiles = Annotated[UploadedFiles, Depends(uploaded_files, scope="function")]


async def _form(request: Request, service: Service) -> FormData:
    """The parts of the body. One that is no multipart, or not all of it, is refused."""
    media_type, options = parse_options_header(request.headers.get("content-type", ""))
    if media_type != b"multipart/form-data":
        raise UnsupportedMediaType(f"an upload is multipart/form-data, not {media_type.decode('latin-1')[:100]!r}")
    charset = options.get(b"charset", b"utf-8").decode("latin-1")
    if charset.lower() not in _CHARSETS:  # Python knows codecs that make half characters, or programs, of bytes
        raise UnsupportedMediaType(f"an upload is in UTF-8, not {charset[:100]!r}")
    settings = service.settings
    parser = _Parser(
        request.headers,
        request.stream(),
        max_files=settings.upload_max_files,
        max_fields=_FIELDS,
        max_part_size=settings.body_max_bytes,
    )
    try:
        form = await parser.parse()
    except MultiPartException as error:
        raise HTTPException(400, f"the body is no multipart/form-data that is read: {error.message}") from None
    except ClientDisconnect:
        raise HTTPException(400, "the connection ended before the body did") from None
    if not parser.ended:
        await form.close()
        raise HTTPException(400, "the body ends early: its closing boundary is missing")
    return form


def _files(form: FormData, limits: Limits) -> UploadedFiles:
    parts: dict[str, UploadFile | bytes] = {}
    faults = []
    items = form.multi_items()
    described = any(name == "manifest" for name, _ in items)
    for field, part in items:
        if field == "manifest":
            name = DOCUMENT
        elif isinstance(part, UploadFile):
            name = part.filename or ""
            message = "the manifest is the part of that name" if name == DOCUMENT else _name_fault(name, described)
            if message is not None:
                faults.append(Fault(name[:_SHOWN] or field, message))
                continue
        else:
            faults.append(Fault(field[:_SHOWN], "not a file part"))
            continue
        if name in parts:
            faults.append(Fault("manifest" if field == "manifest" else name, "given twice"))
        parts[name] = part if isinstance(part, UploadFile) else part.encode()
    folders = {str(folder) for name in parts for folder in PurePosixPath(name).parents}
    faults += [Fault(name, "both a file and a folder") for name in parts if name in folders]
    if faults:
        raise InvalidInput("the upload has parts that cannot be used", faults=tuple(faults))
    return UploadedFiles(parts, limits)


def _name_fault(name: str, described: bool) -> str | None:
    """What is wrong with the name of a file; beside a manifest it is one of its CAD files, else it stands alone."""
    if len(name) > _NAME_MAX or not name.isprintable():
        return f"a name of {len(name)} characters; at most {_NAME_MAX}, all of them printable, are allowed"
    if described:
        try:
            check_file_name(name)
        except PydanticCustomError as error:
            return error.message()
    return None
