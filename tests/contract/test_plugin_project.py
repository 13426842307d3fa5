"""A new plug-in's project passes its own tests at once, and what is installed can be checked by the command."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from gripwright.cli.plugin_project import write_project
from gripwright.domain.errors import Conflict, InvalidInput
from gripwright.plugin_api.manifest import KINDS
from gripwright.testing import checks_for
from plugin_factory import install

TESTING = Path(__file__).parents[2] / "docs/plugins/testing.md"

CRASHES = '''
import ctypes

import numpy as np
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Box
from gripwright.plugin_api import API_VERSION, Manifest, Params, PluginEntry


class Crashes:
    """Ends the process."""

    key = "crashes"
    params_model = Params

    def __init__(self, params):
        self.params = params

    def fit(self, component, segment, ctx):
        ctypes.string_at(0)


class Hangs(Crashes):
    """Never comes back to Python."""

    key = "hangs"

    def fit(self, component, segment, ctx):
        return sum(range(10**15))


class Declines(Crashes):
    """Fits nothing."""

    key = "declines"

    def fit(self, component, segment, ctx):
        print("{a line of its own")
        return Rejection("none", "fits nothing")


class Raises(Crashes):
    key = "raises"

    def fit(self, component, segment, ctx):
        raise ValueError("no ball")


manifest = Manifest(
    version="1.0", api_version=API_VERSION,
    plugins=tuple(
        PluginEntry(kind="fitter", key=c.key, target=f"{__name__}:{c.__name__}") for c in (Crashes, Hangs, Declines, Raises)
    ),
)
'''

SAMPLED = '''
import numpy as np
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Box
from gripwright.geometry.drawn import extruded
from gripwright.plugin_api import API_VERSION, Manifest, Params, PluginEntry


class Cubes:
    """Fits a shape that no built-in sample has."""

    key = "cubes"
    params_model = Params

    def __init__(self, params):
        self.params = params

    def fit(self, component, segment, ctx):
        points = component.mesh.triangles_mm[segment.faces].reshape(-1, 3)
        extents = np.ptp(points, axis=0)
        if np.ptp(extents) > 1e-6 or not np.isclose(np.prod(extents), segment.hull_volume_mm3):
            return Rejection("no-cube", "no cube along the axes")
        X = np.eye(4)
        X[:3, 3] = points.min(axis=0) + extents / 2.0
        return Box(X_CB=X, extents_mm=extents, filled=np.ones(6), filled_min=0.5, rms_mm=0.0)


class Untried(Cubes):
    key = "untried"


def cubes():
    from gripwright.testing import Sample

    square = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])
    return [Sample.of("cube", extruded(square, np.eye(4), 8.0))]


def nothing():
    raise LookupError("no cube at hand")


manifest = Manifest(
    version="1.0", api_version=API_VERSION,
    plugins=(
        PluginEntry(kind="fitter", key="cubes", target=f"{__name__}:Cubes", samples=f"{__name__}:cubes"),
        PluginEntry(kind="fitter", key="untried", target=f"{__name__}:Untried", samples=f"{__name__}:nothing"),
    ),
)
'''


def run(folder: Path, *arguments: str, path: Path | str, allow: list[str] | None = None) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(path), os.environ.get("PYTHONPATH", "")])}
    if allow is not None:
        environment["GRIPWRIGHT_PLUGINS_ALLOW"] = json.dumps(allow)
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder in which plug-ins are installed; nothing else is allowed."""
    folder = tmp_path / "site"
    folder.mkdir()
    install(folder, "gripwright-fakes", CRASHES)
    monkeypatch.setenv("GRIPWRIGHT_PLUGINS_ALLOW", '["gripwright-fakes"]')
    return folder


def test_a_new_project_of_every_kind_passes_its_own_tests(tmp_path):
    folders = {kind: write_project(f"my_{kind}", [kind], tmp_path)[0] for kind in KINDS}
    folders["fitter and rule"] = write_project("pair", ["rule", "fitter"], tmp_path)[0]
    sources = os.pathsep.join(str(folder / "src") for folder in folders.values())

    options = ("-q", "-rA", "-p", "no:cacheprovider", "--import-mode", "importlib", "--rootdir", str(tmp_path))
    tested = run(tmp_path, "pytest", *options, *map(str, folders.values()), path=sources)

    assert tested.returncode == 0, tested.stdout
    for kind in KINDS:
        of_kind = rf"^PASSED gripwright-my-{kind}/tests/test_{kind}\.py::"
        assert len(re.findall(of_kind, tested.stdout, re.M)) > len(checks_for(kind))
        of_pair = rf"^PASSED gripwright-pair/tests/test_{kind}\.py::"
        assert bool(re.search(of_pair, tested.stdout, re.M)) == (kind in ("fitter", "rule"))
    assert not [file for file in tmp_path.rglob("*.*") if file.is_file() and b"$" in file.read_bytes() and file.suffix != ".pyc"]


def test_the_page_on_testing_names_what_a_new_fitter_has(tmp_path):
    folder, _ = write_project("ball", ["fitter"], tmp_path)
    source = (folder / "src/gripwright_ball/fitter.py").read_text(encoding="utf-8")

    imported = re.findall(r"^from gripwright_ball.fitter import (.+)$", TESTING.read_text(encoding="utf-8"), re.M)

    names = {name for line in imported for name in line.split(", ")}
    assert names >= {"BallFitter"}
    assert names <= set(re.findall(r"^class (\w+)", source, re.M))


def test_a_project_is_not_written_over_another(tmp_path):
    write_project("ball", ["fitter"], tmp_path)

    with pytest.raises(Conflict, match="exists already"):
        write_project("ball", ["rule"], tmp_path)


@pytest.mark.parametrize("name", ["Ball", "a-ball", "../ball", "1ball", "_ball", "ball_", "", "b" * 41, "ball\n"])
def test_a_name_that_is_no_key_is_refused(name, tmp_path):
    with pytest.raises(InvalidInput, match="no name for a plug-in"):
        write_project(name, ["fitter"], tmp_path)

    assert list(tmp_path.iterdir()) == []


def test_a_kind_that_there_is_not_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="kinds are segmenter, fitter"):
        write_project("ball", ["fitters"], tmp_path)


@pytest.mark.parametrize("kinds", [["fitter", "hand"], ["fitter", "fitter"], ["fitter", "rule", "hand"]])
def test_of_several_kinds_only_a_fitter_and_its_rule_are_begun_together(kinds, tmp_path):
    with pytest.raises(InvalidInput, match=f"only fitter and rule are begun together, not {', '.join(kinds)}"):
        write_project("ball", kinds, tmp_path)

    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_a_project_and_says_where(tmp_path):
    made = run(tmp_path, "gripwright.cli", "plugins", "new", "ball", "--kind", "fitter", path=tmp_path)

    assert made.returncode == 0, made.stderr
    assert "gripwright-ball" in made.stdout
    assert "`gripwright plugins check fitter/ball`" in made.stdout
    assert "docs/plugins/README.md" in made.stdout
    assert (tmp_path / "gripwright-ball/src/gripwright_ball/fitter.py").is_file()


def test_checking_names_what_crashes_hangs_and_raises_and_goes_on(site):
    checked = run(site, "gripwright.cli", "plugins", "check", "--time-limit", "0.5", path=site)

    assert checked.returncode == 1, checked.stderr
    assert re.search(r"^fitter/crashes: fails\n  crash: its process ended with SIGSEGV during the checks$", checked.stdout, re.M)
    assert re.search(r"^fitter/hangs: fails\n  crash: its process raised, or did not come back within 2 s$", checked.stdout, re.M)
    assert "fitter/declines: fails\n  fits: none of 18 segments is answered with a primitive" in checked.stdout
    assert re.search(r"^fitter/raises: fails\n  answers: .* fit raises ValueError: no ball;", checked.stdout, re.M)


def test_plugins_are_checked_with_the_samples_that_their_manifest_names(site):
    install(site, "gripwright-sampled", SAMPLED)

    checked = run(site, "gripwright.cli", "plugins", "check", path=site, allow=["gripwright-sampled"])

    assert re.fullmatch(
        r"fitter/cubes: passes\nfitter/untried: fails\n  samples: \w+:nothing raises LookupError: no cube at hand\n",
        checked.stdout,
    ), checked.stdout
    assert checked.returncode == 1


def test_another_version_of_the_distribution_than_the_manifests_is_told(site):
    install(site, "gripwright-sampled", SAMPLED, version="1.3")

    checked = run(site, "gripwright.cli", "plugins", "check", "cubes", path=site, allow=["gripwright-sampled"])

    assert checked.stdout == "fitter/cubes: passes\n"
    assert "note: gripwright-sampled is 1.3, its manifest says 1.0: this is shown, and stored with results" in checked.stderr


def test_one_plugin_is_checked_by_its_key(site):
    checked = run(site, "gripwright.cli", "plugins", "check", "raises", path=site)

    assert checked.returncode == 1
    assert [line for line in checked.stdout.splitlines() if not line.startswith(" ")] == ["fitter/raises: fails"]


def test_a_key_that_is_not_installed_is_refused(site):
    checked = run(site, "gripwright.cli", "plugins", "check", "cone", path=site)

    assert checked.returncode == 1
    assert checked.stderr.startswith("no plug-in 'cone' is installed; there are fitter/crashes, ")


def test_the_list_as_json_has_the_schemas_of_all_options(site):
    listed = run(site, "gripwright.cli", "plugins", "--json", path=site)

    description = json.loads(listed.stdout)
    assert [plugin["key"] for plugin in description["plugins"]] == ["crashes", "hangs", "declines", "raises"]
    assert {plugin["options"]["type"] for plugin in description["plugins"]} == {"object"}
    assert description["failures"] == []
    assert description["plan"]["properties"]["fitters"]["x-plugins"] == "fitter"
    assert "params" not in description["plan"]["properties"]


def test_what_is_deprecated_is_told_once_a_distribution_beside_the_list(site):
    old = CRASHES.replace('version="1.0"', 'name="old", version="1.0"').replace('key = "', 'key = "old_')
    install(site, "gripwright-old", old)

    listed = run(site, "gripwright.cli", "plugins", path=site, allow=["gripwright-fakes", "gripwright-old"])

    assert len(listed.stdout.splitlines()) == 8
    assert listed.stderr.splitlines() == [
        "deprecated: gripwright-old: Manifest.name is deprecated since plug-in API 1.2 and gone in 2.0: "
        "leave it out, the distribution's own name is used"
    ]


def test_the_list_needs_no_further_word(site):
    listed = run(site, "gripwright.cli", "plugins", path=site)

    assert listed.returncode == 0
    assert [line.split()[1] for line in listed.stdout.splitlines()] == ["crashes", "hangs", "declines", "raises"]
