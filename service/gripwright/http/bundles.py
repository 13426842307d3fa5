"""Uploads of several packages: parts of their own, or archives that hold them."""

from collections.abc import Iterator
from functools import partial

from gripwright.cad.archive import SingleFile
from gripwright.cad.bundle import is_bundle, open_bundle
from gripwright.cad.limits import Limits
from gripwright.cad.package import DOCUMENT
from gripwright.domain.errors import Fault, GripwrightError, InvalidInput, LimitExceeded
from gripwright.http.uploads import UploadedFiles
from gripwright.jobs.product_import import Package


def packages_of(upload: UploadedFiles, limits: Limits, *, most: int) -> list[Package]:
    """The packages of an upload, each read when it is its turn; LimitExceeded where there are more than `most`."""
    if DOCUMENT in upload.names or not upload.names:
        fault = Fault("manifest" if upload.names else "package", "an import is made of .zip and STEP files alone")
        raise InvalidInput("the upload is no import", faults=(fault,))
    packages = [package for name in upload.in_order for package in _packages(name, upload, limits)]
    if len(packages) > most:
        raise LimitExceeded(f"the import holds {len(packages)} packages, at most {most}")
    return packages


def _packages(name: str, upload: UploadedFiles, limits: Limits) -> Iterator[Package]:
    """The package that a part is, or those that it holds."""
    data = upload.read(name)
    if not (name.lower().endswith(".zip") and is_bundle(data)):
        yield Package(name=name, files=SingleFile(name, lambda: data, limits))
        return
    try:
        bundle = open_bundle(data, name, limits)
    except GripwrightError as error:
        yield Package(name=name, refusal=error)
        return
    for inner in sorted(bundle.names):
        yield Package(name=f"{name}/{inner}", files=SingleFile(inner, partial(bundle.read, inner), limits))
