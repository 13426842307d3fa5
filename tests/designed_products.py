"""Products as the command line designs them, once a session: what tests of whole designs look at."""

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Protocol

import pytest

from example_plugins import install_examples

REPOSITORY = Path(__file__).resolve().parents[1]
PUMP = REPOSITORY / "service/gripwright/samples/pump"
SHARED = REPOSITORY.parent / "shared" / "data"
PAPER = ("plan=paper", "actuators=paper", "release_clearance=0")
COMPLETE, INCOMPLETE = 0, 3


class Designed(Protocol):
    """Designs a package with `--set` options; exit code and design folder."""

    def __call__(
        self, package: Path, settings: tuple[str, ...] = (), *, again: int = 0, examples: bool = False
    ) -> tuple[int, Path]: ...


def designer(tmp_path_factory: pytest.TempPathFactory) -> Designed:
    """Runs the command as a user would, with the built-in plug-ins alone; the same call is answered from memory.

    Runs share a data folder, so that what products have in common is computed once; with `again` a run has one of its own. With
    `examples` the distributions of plug-ins beside the built-in one are installed, too.
    """
    shared = tmp_path_factory.mktemp("data")

    @cache
    def once(package: Path, settings: tuple[str, ...], again: int, examples: bool) -> tuple[int, Path]:
        folder = tmp_path_factory.mktemp(package.name)
        data = folder / "data" if again else shared
        command = [str(Path(sys.executable).parent / "gripwright"), "design", str(package), "--out", str(folder / "design")]
        for setting in settings:
            command += ["--set", setting]
        environment = os.environ | {"GRIPWRIGHT_DATA": str(data), "GRIPWRIGHT_PLUGINS_ALLOW": '["gripwright"]'}
        if examples:
            names, environment["PYTHONPATH"] = install_examples(tmp_path_factory.mktemp("site"))
            environment["GRIPWRIGHT_PLUGINS_ALLOW"] = json.dumps(["gripwright", *names])
        finished = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert finished.returncode in (COMPLETE, INCOMPLETE), finished.stderr
        return finished.returncode, folder / "design"

    def design(package: Path, settings: tuple[str, ...] = (), *, again: int = 0, examples: bool = False) -> tuple[int, Path]:
        return once(package, settings, again, examples)

    return design


def shared_package(name: str) -> Path:
    """A public assembly beside the project; skips where it is absent, fails with CI=true."""
    package = SHARED / name
    if not package.is_dir():
        if os.environ.get("CI") == "true":
            pytest.fail(f"{package} is absent")
        pytest.skip(f"{package} is absent")
    return package
