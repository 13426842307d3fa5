"""Whatever a plug-in does to its process, its step fails with the plug-in's own name, and nothing else is harmed."""

import json
import os
import subprocess
import sys
import threading
import time
from dataclasses import replace

import pytest
from fake_calculation import STAGES_AT

from gripwright.design.plan import plan_of
from gripwright.domain.errors import Cancelled, GripwrightError, PluginFailure
from gripwright.jobs.child import Limits
from gripwright.jobs.engine import PassingFailure, StepBroke, problem_of
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import Workshop
from plugin_factory import FAKE_OPTIONS, install

BAD = '''
import ctypes
import os
import signal
import time

from gripwright.domain.errors import Cancelled
from gripwright.plugin_api import API_VERSION, Manifest, Params, PluginEntry


class Basic:
    params_model = Params

    def __init__(self, params):
        self.params = params

    def solve(self, problem, ctx):
        return self.work(ctx)


class Hangs(Basic):
    key = "hangs"

    def work(self, ctx):
        while True:
            pass


class HangsOutsidePython(Basic):
    key = "hangs_outside_python"

    def work(self, ctx):
        return sum(range(10**15))


class Crashes(Basic):
    key = "crashes"

    def work(self, ctx):
        ctypes.string_at(0)


class Aborts(Basic):
    key = "aborts"

    def work(self, ctx):
        os.abort()


class Leaves(Basic):
    key = "leaves"

    def work(self, ctx):
        raise SystemExit(3)


class LeavesAtOnce(Basic):
    key = "leaves_at_once"

    def work(self, ctx):
        os._exit(4)


class Hogs(Basic):
    key = "hogs"

    def work(self, ctx):
        return bytearray(3 * 2**29)


class IsKilled(Basic):
    """As by the kernel that needs memory."""

    key = "is_killed"

    def work(self, ctx):
        os.kill(os.getpid(), signal.SIGKILL)


class Raises(Basic):
    key = "raises"

    def work(self, ctx):
        raise ZeroDivisionError("divided by nothing")


class CannotBeStopped(Basic):
    key = "cannot_be_stopped"

    def work(self, ctx):
        while True:
            try:
                ctx.progress(0.5, "for ever")
                time.sleep(0.01)
            except BaseException:
                continue


PLUGINS = (Hangs, HangsOutsidePython, Crashes, Aborts, Leaves, LeavesAtOnce, Hogs, IsKilled, Raises, CannotBeStopped)
manifest = Manifest(
    version="2.7", api_version=API_VERSION,
    plugins=tuple(PluginEntry(kind="optimizer", key=c.key, target=f"{__name__}:{c.__name__}") for c in PLUGINS),
)
'''


@pytest.fixture
def bad(tmp_path, plugins):
    """A workshop whose plug-ins may take half a second and 512 MB a call."""
    install(tmp_path / "site", "gripwright-bad", BAD)
    limits = Limits(memory_mb=1024, timeout_s=120.0, plugin_memory_mb=512, plugin_timeout_s=0.5)
    return Workshop(data_dir=tmp_path / "data", plugins_allow=(plugins, "gripwright-bad"), limits=limits, stages_at=STAGES_AT)


def runner(workshop, key, **options):
    return LocalRunner(workshop, plan_of({**FAKE_OPTIONS, "optimizer": key}), **options)


def ask(workshop, log, key):
    runner(workshop, key).map("second", [{"log": log, "name": key, "act": "plugin"}])


@pytest.mark.parametrize(
    ("key", "kind", "words"),
    [
        ("hangs", StepBroke, "took more than the 0.5 s that one call of a plug-in may take"),
        ("hangs_outside_python", StepBroke, "took more than the 0.5 s that one call of a plug-in may take"),
        ("crashes", StepBroke, "crashed with SIGSEGV"),
        ("aborts", StepBroke, "crashed with SIGABRT"),
        ("leaves", StepBroke, "ended with code 3 and no result"),
        ("leaves_at_once", StepBroke, "ended with code 4 and no result"),
        ("hogs", StepBroke, "needs more than the 512 MB of memory that one call of a plug-in may take"),
        ("is_killed", PassingFailure, "was ended with SIGKILL"),
        ("cannot_be_stopped", StepBroke, "took more than the 0.5 s that one call of a plug-in may take"),
    ],
)
def test_a_plugin_that_breaks_its_process_is_named_with_distribution_and_version(bad, log, key, kind, words):
    with pytest.raises(kind) as failure:
        ask(bad, log, key)

    problem = problem_of(failure.value)
    assert (problem["stage"], problem["plugin"]) == ("second", f"optimizer/{key}")
    assert words in problem["detail"]
    assert problem["detail"].endswith(f", in optimizer/{key} (gripwright-bad 2.7)")


def test_a_plugin_that_raises_is_named_with_distribution_and_version(bad, log):
    with pytest.raises(GripwrightError) as failure:
        ask(bad, log, "raises")

    assert problem_of(failure.value) == {
        "code": PluginFailure.code,
        "title": "plugin failure",
        "detail": "optimizer/raises raised ZeroDivisionError: divided by nothing (gripwright-bad 2.7)",
        "stage": "second",
        "plugin": "optimizer/raises",
        "errors": [],
    }


def test_a_plugin_that_swallows_the_cancellation_is_ended_all_the_same(bad, log):
    patient = replace(bad, limits=Limits())
    stop = threading.Event()
    threading.Timer(1.0, stop.set).start()
    stopped = runner(patient, "cannot_be_stopped", cancelled=stop.is_set)
    start = time.monotonic()

    with pytest.raises(Cancelled):
        stopped.map("second", [{"log": log, "name": "a", "act": "plugin"}])

    assert time.monotonic() - start < 5.0


def test_without_limits_of_its_own_a_plugin_has_those_of_its_step(bad, log):
    step_alone = replace(bad, limits=Limits(memory_mb=1024, timeout_s=4.0))

    for key, words in (("hangs", "took more than 4 s, in optimizer/hangs"), ("hogs", "needs more than 1024 MB of memory, in")):
        with pytest.raises(StepBroke) as failure:
            ask(step_alone, log, key)
        assert words in failure.value.detail


def run_apart(folder, script, **environment):
    """What a script prints in a process that has no server of children yet; modules in the folder can be imported."""
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    ran = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return ran.stdout


RESOLVE = """
import json
from pathlib import Path
from gripwright.design.plan import plan_of
from gripwright.domain.errors import GripwrightError
from gripwright.jobs.engine import problem_of
from gripwright.jobs.steps import Workshop, resolve_plan

try:
    resolve_plan(Workshop(data_dir=Path("unused"), plugins_allow=("gripwright-crash",)), plan_of({}))
except GripwrightError as error:
    print(json.dumps(problem_of(error)))
"""
HANGING = """
import multiprocessing
from gripwright.jobs.child import ChildNotStarted, Limits, run_in_child

multiprocessing.get_context("forkserver").set_forkserver_preload(["hangs"])
try:
    run_in_child(print, None, limits=Limits(timeout_s=0.5))
except ChildNotStarted as failure:
    print(failure)
"""


def test_a_plugin_that_crashes_at_its_import_fails_the_design_with_its_distributions_name(tmp_path):
    install(tmp_path, "gripwright-crash", "import ctypes\nctypes.string_at(0)")

    problem = json.loads(run_apart(tmp_path, RESOLVE, GRIPWRIGHT_PLUGINS_ALLOW='["gripwright-crash"]'))

    assert (problem["code"], problem["stage"], problem["plugin"]) == (PluginFailure.code, "plan", "gripwright-crash")
    assert "ended with code -11 while gripwright-crash was loaded" in problem["detail"]


def test_a_server_of_children_that_hangs_is_ended_in_time_and_leaves_nothing_behind(tmp_path):
    (tmp_path / "hangs.py").write_text("while True:\n    pass\n")

    printed = run_apart(tmp_path, HANGING)  # comes back when the last process has let go of the output

    assert printed == "could not be started in time\n"


@pytest.mark.parametrize("act", ["segfault", "memory"])
def test_what_the_step_itself_breaks_names_no_plugin(bad, log, act):
    with pytest.raises(StepBroke) as failure:
        runner(bad, "hangs").map("second", [{"log": log, "name": "a", "act": act}])

    assert failure.value.context["plugin"] is None


def test_a_plan_cannot_raise_the_limits(bad):
    for option in ("plugin_timeout_s", "plugin_memory_mb", "step_timeout_s", "hangs.plugin_timeout_s"):
        with pytest.raises(GripwrightError) as refused:
            LocalRunner(bad, plan_of({**FAKE_OPTIONS, "optimizer": "hangs", option: 1e6}))
        assert refused.value.code == "invalid-plan"
