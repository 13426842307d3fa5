"""A new plug-in's project, from templates: one plug-in of any kind, or a fitter and its rule."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
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
}
"""Path in the project → template."""
_FILES_OF_PLUGIN = {"src/{module}/{kind}.py": "kinds/{template}.py", "tests/test_{kind}.py": "tests.py"}
_FILES_OF_FITTER = {"src/{module}/samples.py": "samples.py"}
_RENAMING = """
`three_finger_{name}` is named for the grip that the example asks for. Name yours for its own: the `key` and the classes in
`src/{module}/rule.py`, the entry in `src/{module}/__init__.py`, the import in `tests/test_rule.py`.
"""
_TOGETHER = ("fitter", "rule")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Begun:
    """A plug-in of the project: its class, and the template that it is made from."""

    kind: str
    key: str
    plugin: str
    template: str


def write_project(name: str, kinds: Sequence[str], out: Path) -> tuple[Path, list[str]]:
    """Write the project of a plug-in with that key, or of a fitter and its rule; its folder, and each kind/key in it.

    InvalidInput, or Conflict where the folder exists.
    """
    begun = _begun(name, kinds)
    module = f"gripwright_{name}"
    words = {
        "name": name,
        "module": module,
        "distribution": f"gripwright-{name.replace('_', '-')}",
        "shape": _class_name(name),
        "api_version": API_VERSION,
        "announced": " and the ".join(f"{one.kind} `{one.key}`" for one in begun),
        "checks": "\n".join(f"gripwright plugins check {one.kind}/{one.key}" for one in begun),
        "check_steps": "\n".join(f"      - run: gripwright plugins check {one.kind}/{one.key}" for one in begun),
        "renaming": _RENAMING.format(module=module, name=name) if len(begun) > 1 else "",
        "sources": " and ".join(f"`src/{module}/{one.kind}.py`" for one in begun),
    }
    has_samples = any(one.kind == "fitter" for one in begun)
    words["entries"] = "\n".join(_entry(one, words, has_samples) for one in begun)
    words["import_samples"] = f"from {module}.samples import samples\n" if has_samples else ""
    words["own_samples"] = ", samples=samples()" if has_samples else ""
    folder = out / words["distribution"]
    try:
        folder.mkdir(parents=True)
        _write(folder, _FILES | (_FILES_OF_FITTER if has_samples else {}), words)
        for one in begun:
            of_plugin = {"kind": one.kind, "key": one.key, "plugin": one.plugin, "template": one.template}
            _write(folder, _FILES_OF_PLUGIN, words | of_plugin)
    except FileExistsError:
        raise Conflict(f"{folder} exists already") from None
    except OSError as error:
        raise InvalidInput(f"the project cannot be written: {error}") from None
    return folder, [f"{one.kind}/{one.key}" for one in begun]


def _begun(name: str, kinds: Sequence[str]) -> list[_Begun]:
    """The plug-ins of a project of that name, or why there is none: InvalidInput."""
    if not _NAME.fullmatch(name) or len(name) > _NAME_MAX:
        raise InvalidInput(
            f"{name!r} is no name for a plug-in: at most {_NAME_MAX} lower case letters, digits and _ between them"
        )
    for kind in kinds:
        if kind not in KINDS:
            raise InvalidInput(f"there is no kind {kind!r}; kinds are {', '.join(KINDS)}")
    shape = _class_name(name)
    fitter = _Begun(kind="fitter", key=name, plugin=f"{shape}Fitter", template="fitter")
    if len(kinds) == 1:
        (kind,) = kinds
        return [fitter if kind == "fitter" else _Begun(kind=kind, key=name, plugin=shape, template=kind)]
    if sorted(kinds) != sorted(_TOGETHER):
        raise InvalidInput(f"of several kinds only {' and '.join(_TOGETHER)} are begun together, not {', '.join(kinds)}")
    # a key of its own: parameters go by the key, whatever the kind
    return [fitter, _Begun(kind="rule", key=f"three_finger_{name}", plugin=f"ThreeFinger{shape}", template="rule_of_fitter")]


def _class_name(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


def _entry(one: _Begun, words: dict[str, str], has_samples: bool) -> str:
    """Its lines in the manifest."""
    module = words["module"]
    fields = [f'kind="{one.kind}"', f'key="{one.key}"', f'target="{module}.{one.kind}:{one.plugin}"']
    fields += [f'primitives=("{module}.fitter:{words["shape"]}",)'] if one.kind == "fitter" else []
    fields += [f'samples="{module}.samples:samples"'] if has_samples else []
    return "\n".join(["        PluginEntry(", *(f"            {field}," for field in fields), "        ),"])


def _write(folder: Path, paths: dict[str, str], words: dict[str, str]) -> None:
    templates = files("gripwright.cli") / "project"
    for path, template in paths.items():
        file = folder / path.format(**words)
        file.parent.mkdir(parents=True, exist_ok=True)
        text = (templates / f"{template.format(**words)}.txt").read_text(encoding="utf-8")
        file.write_text(Template(text).substitute(words), encoding="utf-8")
