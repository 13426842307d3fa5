"""Several packages in one archive."""

import zipfile
from collections.abc import Iterator
from pathlib import Path

from gripwright.cad.archive import open_archive
from gripwright.cad.limits import Limits


def is_bundle(path: Path) -> bool:
    """Whether an archive holds packages: archives, and no product.json of its own."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return False  # whoever reads it as a package will say what is wrong with it
    described = any(name == "product.json" or (name.endswith("/product.json") and name.count("/") == 1) for name in names)
    return not described and any(name.lower().endswith(".zip") for name in names)


def bundled(path: Path, label: str, limits: Limits) -> Iterator[tuple[str, bytes]]:
    """The names and contents of what a bundle holds, in order of the names; refusals are those of a package's archive."""
    files = open_archive(path.read_bytes(), label, limits, of_packages=True)
    for name in sorted(files.names):
        yield name, files.read(name)
