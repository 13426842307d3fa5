"""The distributions of plug-ins beside the built-in one, installed into a folder of a test as pip leaves them."""

import os
import tomllib
from collections.abc import Sequence
from pathlib import Path

PLUGINS = Path(__file__).resolve().parents[1] / "plugins"


def example_projects() -> list[Path]:
    """The folders of distributions in plugins/ that have a project of their own."""
    return sorted(project.parent for project in PLUGINS.glob("*/pyproject.toml"))


def install_examples(site: Path, projects: Sequence[Path] | None = None) -> tuple[list[str], str]:
    """Announce the projects in a folder; the names of their distributions, and a PYTHONPATH by which they are found."""
    names, paths = [], [str(site)]
    for folder in example_projects() if projects is None else projects:
        project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        info = site / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
        info.mkdir(parents=True)
        info.joinpath("METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
        points = "".join(f"{name} = {target}\n" for name, target in project["entry-points"]["gripwright.plugins"].items())
        info.joinpath("entry_points.txt").write_text(f"[gripwright.plugins]\n{points}")
        names.append(project["name"])
        paths.append(str(folder / "src" if (folder / "src").is_dir() else folder.parent))
    return names, os.pathsep.join([*dict.fromkeys(paths), os.environ.get("PYTHONPATH", "")])
