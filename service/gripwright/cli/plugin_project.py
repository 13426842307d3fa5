"""A new plug-in's project, from templates."""

import re
from importlib.resources import files
from pathlib import Path
from string import Template

from gripwright.domain.errors import Conflict, InvalidInput
from gripwright.plugin_api.manifest import API_VERSION, KINDS

_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_NAME_MAX = 40
_FILES = {
    "pyproject.toml": "pyproject.toml",
    "README.md": "README.md",
    ".github/workflows/test.yml": "test.yml",
    "src/{module}/__init__.py": "manifest.py",
    "src/{module}/{kind}.py": "kinds/{kind}.py",
    "tests/test_{kind}.py": "tests.py",
}
"""Path in the project → template."""
_FITTER_FILES = {"src/{module}/samples.py": "samples.py"}


def write_project(name: str, kind: str, out: Path) -> Path:
    """Write the project of a plug-in with that key; its folder. InvalidInput, or Conflict where the folder exists."""
    if not _NAME.fullmatch(name) or len(name) > _NAME_MAX:
        raise InvalidInput(
            f"{name!r} is no name for a plug-in: at most {_NAME_MAX} lower case letters, digits and _ between them"
        )
    if kind not in KINDS:
        raise InvalidInput(f"there is no kind {kind!r}; kinds are {', '.join(KINDS)}")
    distribution = f"gripwright-{name.replace('_', '-')}"
    shape = "".join(word.capitalize() for word in name.split("_"))
    words = {
        "name": name,
        "kind": kind,
        "module": f"gripwright_{name}",
        "distribution": distribution,
        "shape": shape,
        "plugin": f"{shape}Fitter" if kind == "fitter" else shape,
        "api_version": API_VERSION,
    }
    of_fitter = {
        "further": f"""
            primitives=("{words["module"]}.fitter:{shape}",),
            samples="{words["module"]}.samples:samples",""",
        "import_samples": f"from {words['module']}.samples import samples\n",
        "own_samples": ", samples=samples()",
    }
    words |= {name: text if kind == "fitter" else "" for name, text in of_fitter.items()}
    folder = out / distribution
    templates = files("gripwright.cli") / "project"
    try:
        folder.mkdir(parents=True)
        for path, template in (_FILES | (_FITTER_FILES if kind == "fitter" else {})).items():
            file = folder / path.format(**words)
            file.parent.mkdir(parents=True, exist_ok=True)
            text = (templates / f"{template.format(**words)}.txt").read_text(encoding="utf-8")
            file.write_text(Template(text).substitute(words), encoding="utf-8")
    except FileExistsError:
        raise Conflict(f"{folder} exists already") from None
    except OSError as error:
        raise InvalidInput(f"the project cannot be written: {error}") from None
    return folder
