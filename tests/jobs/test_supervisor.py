import os
import signal
import sys
import time

import psutil

from gripwright.jobs.supervisor import Supervisor
from gripwright.settings import Settings

# A worker that says who it is, and beats.
WORKER = """
import os, sys, time
from gripwright.jobs.supervisor import beat
beat()
with open(sys.argv[1], "a") as log:
    log.write(f"{os.getpid()}\\n")
time.sleep(600)
"""


def test_a_worker_that_hangs_is_replaced_and_one_that_beats_is_not(tmp_path):
    log = tmp_path / "workers"
    settings = Settings(data_dir=tmp_path, workers=1)
    supervisor = Supervisor(settings, command=[sys.executable, "-c", WORKER, str(log)], hung_s=2.5)
    supervisor.start()
    (first,) = _started(log, 1)
    time.sleep(3.0)
    assert _started(log, 1) == [first]

    os.kill(first, signal.SIGSTOP)
    _, second = _started(log, 2)

    assert not psutil.pid_exists(first)
    assert psutil.pid_exists(second)
    supervisor.stop()
    assert not psutil.pid_exists(second)


def _started(log, number):
    """The processes of that many workers, once they have started."""
    deadline = time.monotonic() + 30.0
    while not log.exists() or len(pids := log.read_text().split()) < number:
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.05)
    return [int(pid) for pid in pids]
