"""The short form of tests/soak/fault_matrix.py."""

import os

import pytest
from fault_bench import Bench, can_fill_disks

from postgresql_server import running_postgresql

FAULTS = [("kill-child", "export"), ("kill-worker", "segment"), ("disk-full", "result"), ("kill-api", "fit")]


@pytest.fixture
def bench(tmp_path):
    """A service on SQLite whose disk is its own."""
    if not can_fill_disks():
        missing = "only root can mount a small disk to fill"
        pytest.fail(missing) if os.environ.get("CI") else pytest.skip(missing)
    bench = Bench(tmp_path, disk=True)
    bench.start()
    yield bench
    assert bench.leftovers() == []
    assert bench.stop() == []


def test_whatever_fails_a_design_ends_exactly_once_and_no_finished_step_runs_twice(bench):
    broken = {(fault, place): bench.run(f"run-{number}", fault, place) for number, (fault, place) in enumerate(FAULTS)}

    assert broken == {fault: [] for fault in FAULTS}


def test_a_restarted_postgresql_loses_and_doubles_nothing(tmp_path):
    with running_postgresql() as server:
        bench = Bench(tmp_path, postgresql=server)
        try:
            bench.start()

            assert bench.run("run", "postgresql-restarted", "select") == []
        finally:
            assert bench.stop() == []
