"""Uploads of several packages: parts of their own, or archives that hold them."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from starlette.datastructures import UploadFile

from gripwright.cad.bundle import bundled, is_bundle
from gripwright.cad.limits import Limits
from gripwright.domain.errors import Fault, GripwrightError, InvalidInput, LimitExceeded
from gripwright.http.uploads import Upload, package_path
from gripwright.jobs.product_import import Package


@contextmanager
def stored_packages(upload: Upload, limits: Limits, *, most: int) -> Iterator[list[Package]]:
    """The packages of an upload, files that are gone afterwards; LimitExceeded where there are more than `most`."""
    if upload.manifest is not None or not upload.files:
        fault = Fault("manifest" if upload.manifest is not None else "package", "an import is made of .zip and STEP files alone")
        raise InvalidInput("the upload is no import", faults=(fault,))
    with tempfile.TemporaryDirectory(prefix="gripwright-import-") as name:
        packages: list[Package] = []
        for part in upload.files:
            for package in _packages(part, Path(name), limits):
                packages.append(package)
                if len(packages) > most:
                    raise LimitExceeded(f"the import holds {len(packages)} packages or more, at most {most}")
        yield packages


def _packages(part: UploadFile, folder: Path, limits: Limits) -> Iterator[Package]:
    """The package that a part is, or those that it holds."""
    name = PurePosixPath(part.filename or "").name
    package = _written(name, part.file.read(), folder)
    if package.refusal is not None or package.path.suffix.lower() != ".zip" or not is_bundle(package.path):
        yield package
        return
    try:
        for inner, data in bundled(package.path, name, limits):
            yield _written(f"{name}/{inner}", data, folder)
    except GripwrightError as error:
        yield Package(name=name, path=package.path, refusal=error)


def _written(name: str, data: bytes, folder: Path) -> Package:
    own = Path(tempfile.mkdtemp(dir=folder))
    try:
        path = package_path(own, PurePosixPath(name).name)
    except InvalidInput as error:
        return Package(name=name, path=own, refusal=error)
    path.write_bytes(data)
    return Package(name=name, path=path)
