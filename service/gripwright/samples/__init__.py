"""The sample product, made by `build_pump` and shipped with the service."""

import shutil
from importlib import resources
from pathlib import Path


def write_sample(directory: Path) -> Path:
    """Copy the sample product as a package (product.json and its CAD files) into `directory`, made where needed; returns it."""
    directory.mkdir(parents=True, exist_ok=True)
    with resources.as_file(resources.files(__name__) / "pump") as package:
        for file in sorted(package.iterdir()):
            shutil.copyfile(file, directory / file.name)
    return directory
