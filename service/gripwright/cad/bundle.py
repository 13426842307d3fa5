"""Several packages in one archive."""

import io
import zipfile

from gripwright.cad.archive import PackageFiles, open_archive
from gripwright.cad.limits import Limits


def is_bundle(data: bytes) -> bool:
    """Whether an archive holds packages: archives, and no product.json of its own."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return False  # whoever reads it as a package will say what is wrong with it
    described = any(name == "product.json" or (name.endswith("/product.json") and name.count("/") == 1) for name in names)
    return not described and any(name.lower().endswith(".zip") for name in names)


def open_bundle(data: bytes, label: str, limits: Limits) -> PackageFiles:
    """The packages that a bundle holds; refusals are those of a package's archive."""
    return open_archive(data, label, limits, of_packages=True)
