"""What is compiled at the first time is told on standard error, once a command, and never where it is found ready."""

import os
import subprocess
import sys

import pytest

from gripwright.cli.compiling import MESSAGE

SOURCE = """
from numba import njit


@njit(cache=True)
def twice(value):
    return value + value


def work(argument, progress, calls):
    return float(twice(argument) + twice(0.5))
"""
HERE = """
from gripwright.cli.compiling import tell_compiling

import compiled
tell_compiling(print)
compiled.work(2, None, None)
"""
IN_CHILDREN = """
from gripwright.cli.run import shown_progress
from gripwright.jobs.child import Limits, run_in_child

import compiled
with shown_progress():
    for argument in (2, True):
        run_in_child(compiled.work, argument, limits=Limits())
"""


@pytest.fixture
def run(tmp_path):
    """Run a script beside a module with a compiled function, which no earlier run of this test has left."""
    (tmp_path / "compiled.py").write_text(SOURCE)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])

    def run(script):
        return subprocess.run(
            [sys.executable, "-c", script], env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=True
        )

    return run


def test_what_is_compiled_is_told_once_and_not_again_by_who_finds_it(run):
    assert run(HERE).stdout == f"{MESSAGE}\n"
    assert run(HERE).stdout == ""


def test_what_children_of_a_command_compile_is_told_once_on_standard_error(run):
    told = run(IN_CHILDREN)

    assert told.stderr.count(MESSAGE) == 1
