"""The process that is kept ready for the next upload (cad/spare.py)."""

import time
from dataclasses import replace

import psutil
import pytest

from gripwright.cad.limits import Limits
from gripwright.cad.reader import CadReader
from gripwright.cad.spare import SpareReader, end_reader
from gripwright.domain.errors import LimitExceeded

LIMITS = Limits(max_triangles=100)
TRIANGLES = b"v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 2 3\nf 1 2 4\n"


@pytest.fixture
def spare():
    spare = SpareReader(LIMITS)
    spare.start()
    yield spare
    spare.stop()


def _ready(spare: SpareReader) -> psutil.Process:
    """The process that waits, after its imports."""
    deadline = time.monotonic() + 60
    while spare.waiting is None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process = psutil.Process(spare.waiting)
    while process.status() != psutil.STATUS_SLEEPING or "numpy" not in "".join(m.path for m in process.memory_maps()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process


def test_the_process_that_waits_reads_one_package_and_another_takes_its_place(spare) -> None:
    first = _ready(spare)
    with CadReader(replace(LIMITS, seconds=5), spare) as reader:
        for name in ("a.obj", "b.obj"):
            assert len(reader.mesh(name, TRIANGLES, "obj", "mm").faces) == 2
        assert first.is_running(), "it serves all files of the package"

    second = _ready(spare)

    assert second.pid != first.pid
    assert not first.is_running()


def test_a_process_that_waits_uses_no_processor_time_and_is_not_held_to_the_time_of_a_file() -> None:
    spared = SpareReader(replace(LIMITS, seconds=0.5, seconds_per_file=0.5))
    spared.start()
    try:
        process = _ready(spared)
        time.sleep(1.0)
        before = sum(process.cpu_times()[:2])
        time.sleep(1.0)

        assert sum(process.cpu_times()[:2]) == before
        with CadReader(replace(LIMITS, seconds=0.5, seconds_per_file=0.5), spared) as reader:
            assert len(reader.mesh("a.obj", TRIANGLES, "obj", "mm").faces) == 2
    finally:
        spared.stop()


def test_one_that_was_killed_while_it_waited_is_not_handed_out(spare) -> None:
    process = _ready(spare)
    process.kill()
    while process.is_running() and process.status() != psutil.STATUS_ZOMBIE:
        time.sleep(0.01)

    assert spare.take(LIMITS) is None
    assert _ready(spare).pid != process.pid


def test_other_limits_than_those_it_was_started_with_get_a_process_of_their_own(spare) -> None:
    _ready(spare)

    with CadReader(replace(LIMITS, max_triangles=1), spare) as reader, pytest.raises(LimitExceeded, match="at most 1"):
        reader.mesh("a.obj", TRIANGLES, "obj", "mm")

    assert spare.waiting is not None


def test_the_one_that_waits_ends_with_its_keeper(spare) -> None:
    taken = _ready(spare)
    child = spare.take(LIMITS)
    waiting = _ready(spare)

    spare.stop()

    assert not waiting.is_running()
    assert child is not None
    assert child.pid == taken.pid
    end_reader(child)
    assert spare.take(LIMITS) is None
