"""The distribution that holds by a face passes its own tests where it is installed, whole designs among them."""

import os
import subprocess
import sys

import pytest

from example_plugins import PLUGINS, install_examples

VACUUM = PLUGINS / "gripwright_vacuum"


@pytest.mark.timeout(600)  # whole designs
def test_the_distribution_passes_its_own_tests(tmp_path):
    _, path = install_examples(tmp_path, [VACUUM])
    environment = {**os.environ, "PYTHONPATH": path, "GRIPWRIGHT_PLUGINS_ALLOW": '["gripwright", "gripwright-vacuum"]'}

    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    tested = subprocess.run(command, cwd=VACUUM, env=environment, capture_output=True, text=True, timeout=580, check=False)

    assert tested.returncode == 0, tested.stdout + tested.stderr
    assert "skipped" not in tested.stdout
