"""What the command line designs keeps every promise, judged by a program that shares no code with it."""

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from checker.promises import check_design

REPOSITORY = Path(__file__).resolve().parents[2]
PUMP = REPOSITORY / "service/gripwright/samples/pump"
SHARED = REPOSITORY.parent / "shared" / "data"
PAPER = ("plan=paper", "actuators=paper", "release_clearance=0")
COMPLETE, INCOMPLETE = 0, 3

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="session")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Designs a package with the command, as a user would, once for all tests."""

    @cache
    def design(package: Path, settings: tuple[str, ...] = ()) -> tuple[int, Path]:
        folder = tmp_path_factory.mktemp(package.name)
        command = [str(Path(sys.executable).parent / "gripwright"), "design", str(package), "--out", str(folder / "design")]
        for setting in settings:
            command += ["--set", setting]
        environment = os.environ | {"GRIPWRIGHT_DATA": str(folder / "data")}
        finished = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert finished.returncode in (COMPLETE, INCOMPLETE), finished.stderr
        return finished.returncode, folder / "design"

    return design


def shared_package(name: str) -> Path:
    package = SHARED / name
    if not package.is_dir():
        if os.environ.get("CI") == "true":
            pytest.fail(f"{package} is absent")
        pytest.skip(f"{package} is absent")
    return package


def test_the_sample_is_designed_completely_and_keeps_every_promise(designed: Any) -> None:
    code, design = designed(PUMP)
    assert (code, check_design(design, PUMP)) == (COMPLETE, [])


def test_the_sample_with_the_papers_settings_keeps_every_promise_but_leaving(designed: Any) -> None:
    code, design = designed(PUMP, PAPER)
    assert (code, check_design(design, PUMP, release_clearance=0.0)) == (COMPLETE, [])


@pytest.mark.parametrize("name", ["industreal-gears", "counter-plate-screws", "as1", "bolt-nut-m16"])
def test_a_design_of_public_models_keeps_every_promise(name: str, designed: Any) -> None:
    package = shared_package(name)
    code, design = designed(package)
    status = json.loads((design / "design.json").read_text())["status"]
    assert (code == COMPLETE) == (status == "complete")
    assert check_design(design, package) == []
