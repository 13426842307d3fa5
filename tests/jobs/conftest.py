import os

import pytest
from fake_calculation import STAGES_AT

from gripwright.design.plan import plan_of
from gripwright.jobs.child import Limits
from gripwright.jobs.steps import Workshop
from plugin_factory import ALL_KINDS, FAKE_OPTIONS, install


@pytest.fixture
def plugins(tmp_path, monkeypatch):
    """A folder on the path with a plug-in of each kind; the distribution's name."""
    folder = tmp_path / "site"
    folder.mkdir()
    install(folder, "gripwright-fakes", ALL_KINDS)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), os.path.dirname(__file__), os.environ.get("PYTHONPATH", "")]))
    return "gripwright-fakes"


@pytest.fixture
def log(tmp_path, monkeypatch):
    """Where steps note what they did; read it with `fake_calculation.executed`."""
    monkeypatch.setenv("FAKE_LOG", str(tmp_path / "steps.log"))
    return str(tmp_path / "steps.log")


@pytest.fixture
def workshop(tmp_path, plugins):
    return Workshop(
        data_dir=tmp_path / "data", plugins_allow=(plugins,), limits=Limits(memory_mb=1024, timeout_s=20.0), stages_at=STAGES_AT
    )


@pytest.fixture
def plan():
    return plan_of(FAKE_OPTIONS)
