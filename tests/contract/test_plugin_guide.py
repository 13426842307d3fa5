"""The guide for plug-in authors works as printed: its files, built as a wheel, are installed, listed and used by a design."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from gripwright.cli.plugin_project import write_project

GUIDE = Path(__file__).parents[2] / "docs/plugins/writing.md"
COMMAND = str(Path(sys.executable).parent / "gripwright")
WITH_BALL = ("fitters=cylinder,box,ball", "rules=three_finger_cylinder,two_finger_box,three_finger_ball")


def printed_files() -> dict[str, str]:
    """The guide's files: a path in backquotes with a colon, then a fenced block."""
    return dict(re.findall(r"^`([\w./-]+)`:\n```\w+\n(.*?)^```$", GUIDE.read_text(encoding="utf-8"), re.S | re.M))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the guide's plug-in, installed from its wheel."""
    project, site = tmp_path_factory.mktemp("gripwright-ball"), tmp_path_factory.mktemp("site")
    for name, text in printed_files().items():
        path = project / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input"]
    subprocess.run(
        [*pip, "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index", "-w", str(project / "dist"), str(project)],
        check=True,
    )
    (wheel,) = (project / "dist").glob("*.whl")
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", "--target", str(site), str(wheel)], check=True)
    return site


def run(site: Path, data: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"PYTHONPATH": path, "GRIPWRIGHT_DATA": str(data)}
    return subprocess.run([COMMAND, *arguments], env=environment, capture_output=True, text=True, check=False)


def ball_package(folder: Path) -> Path:
    """A ball of 60 mm that is set down alone."""
    folder.mkdir()
    trimesh.creation.icosphere(subdivisions=5, radius=30.0).export(folder / "ball.stl")
    above = np.eye(4)
    above[2, 3] = 100.0
    document = {
        "part_number": "BALL-1",
        "revision": "A",
        "name": "Ball",
        "components": [{"id": "ball", "part_number": "BALL-2", "revision": "A", "file": "ball.stl", "units": "mm"}],
        "operations": [
            {
                "id": "op-01",
                "active": ["ball"],
                "passive": [],
                "pose_before": above.tolist(),
                "pose_after": np.eye(4).tolist(),
            }
        ],
    }
    (folder / "product.json").write_text(json.dumps(document))
    return folder


def test_the_guide_prints_the_project_of_a_fitter_and_its_rule(tmp_path: Path) -> None:
    folder, _ = write_project("ball", ["fitter", "rule"], tmp_path)

    written = {str(path.relative_to(folder)): path.read_text(encoding="utf-8") for path in folder.rglob("*.*") if path.is_file()}

    not_shown = {"README.md", ".github/workflows/test.yml", "tests/test_fitter.py", "tests/test_rule.py"}
    assert printed_files() == {name: text for name, text in written.items() if name not in not_shown}


def test_the_guides_plugin_is_listed(site: Path, tmp_path: Path) -> None:
    listed = run(site, tmp_path, "plugins")

    assert listed.returncode == 0, listed.stderr
    assert "three_finger_ball" in listed.stdout
    assert "gripwright-ball" in listed.stdout


@pytest.mark.slow
def test_a_design_uses_the_guides_plugin(site: Path, tmp_path: Path) -> None:
    package = ball_package(tmp_path / "package")
    settings = [part for setting in WITH_BALL for part in ("--set", setting)]

    finished = run(site, tmp_path / "data", "design", str(package), "--out", str(tmp_path / "design"), *settings)

    assert finished.returncode == 0, finished.stderr
    document = json.loads((tmp_path / "design" / "design.json").read_text())
    (segment,) = document["components"][0]["segments"]
    assert segment["primitive"]["kind"] == "ball"
    assert segment["primitive"]["radius"] == pytest.approx(30.0, rel=0.01)
    (gripper,) = document["grippers"]
    assert gripper["gripper_type"] == "centric-3"
    assert document["plan"]["plugins"]["fitter/ball"]["distribution"] == "gripwright-ball"
