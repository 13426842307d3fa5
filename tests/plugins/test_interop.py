"""The example on top of an outside library passes its own tests, and its fitter works in an analysis of the command line."""

import importlib.util
import os
import subprocess
import sys

import manifold3d
import pytest
import trimesh

from example_plugins import PLUGINS, install_examples

RANSAC = PLUGINS / "gripwright_ransac"


@pytest.fixture
def environment(tmp_path):
    """Of a process in which the example is installed."""
    if importlib.util.find_spec("pyransac3d") is None:
        if os.environ.get("CI") == "true":
            pytest.fail("pyransac3d is not installed")
        pytest.skip("pyransac3d is not installed")
    site = tmp_path / "site"
    site.mkdir()
    _, path = install_examples(site, [RANSAC])
    return {**os.environ, "PYTHONPATH": path, "GRIPWRIGHT_DATA": str(tmp_path / "data")}


def run(environment, folder, *arguments):
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False)


def test_the_example_passes_its_own_tests(environment):
    tested = run(environment, RANSAC, "pytest", "-q", "-p", "no:cacheprovider")

    assert tested.returncode == 0, tested.stdout + tested.stderr
    assert "skipped" not in tested.stdout


def test_its_sphere_is_kept_where_it_fits_best(environment, tmp_path):
    ball = manifold3d.Manifold.sphere(30.0, 64).to_mesh64()
    trimesh.Trimesh(ball.vert_properties[:, :3], ball.tri_verts).export(tmp_path / "ball.stl")

    analysed = run(
        environment,
        tmp_path,
        "gripwright.cli",
        "analyse",
        "ball.stl",
        "--units",
        "mm",
        "--set",
        "fitters=cylinder,box,ransac_sphere",
    )

    assert analysed.returncode == 0, analysed.stderr
    assert "ransac_sphere: ransac_sphere kept with 1.00 of the hull's volume" in analysed.stdout
