"""A real service whose processes, disk, database and clock can be made to fail, and what must hold all the same.

Its calculation is `staged_calculation`; API process, supervisor, workers, job engine, databases and files are real.
"""

import contextlib
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil
from fake_calculation import executed
from fake_serve import WORKER
from service import Service
from staged_calculation import STAGES, steps_of, total

from gripwright.settings import Settings
from plugin_factory import ALL_KINDS, install

PLACES = ("queued", "start", *STAGES)
SHARED_FAULTS = ("kill-worker", "kill-child", "kill-api", "stop-worker")
SQLITE_FAULTS = (*SHARED_FAULTS, "disk-full", "database-locked", "engine-locked")
POSTGRESQL_FAULTS = (*SHARED_FAULTS, "postgresql-restarted")
CLOCK_FAULTS = ("clock-forward", "clock-back")
_DISK_MB = 64
_CLOCK_JUMP_S = 3600
_HERE = Path(__file__).parent


class Bench:
    """One service. `postgresql`: a server of both databases; `clock`: its wall clock can jump; `disk`: its disk can be filled."""

    def __init__(self, folder, *, postgresql=None, clock=False, disk=False, workers=2):
        self.folder, self.data, self.postgresql = folder, folder / "data", postgresql
        self.data.mkdir()
        self._has_disk = disk
        if disk:
            subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={_DISK_MB}m", "none", self.data], check=True)
        site = folder / "site"
        site.mkdir()
        install(site, "gripwright-fakes", ALL_KINDS)
        self._clock_file = folder / "clock"
        self._environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(site), str(_HERE), str(_HERE.parent), os.environ.get("PYTHONPATH", "")]),
            "FAKE_LOG": str(folder / "steps.log"),
            "FAKE_CALCULATION": "staged_calculation",
            "GRIPWRIGHT_DATA": str(self.data),
            "GRIPWRIGHT_PLUGINS_ALLOW": '["gripwright-fakes"]',
            "GRIPWRIGHT_WORKERS": str(workers),
            "GRIPWRIGHT_STEP_MEMORY_MB": "1024",
        }
        if clock:
            self._set_clock(0)
            self._environment |= {"LD_PRELOAD": _wall_clock(folder), "WALL_CLOCK_FILE": str(self._clock_file)}
        fields = {"data_dir": self.data}
        if postgresql is not None:
            self._environment |= {"GRIPWRIGHT_DATABASE_URL": postgresql.url(), "GRIPWRIGHT_JOBS_DATABASE_URL": postgresql.url()}
            fields["database_url"] = postgresql.url()
        self.log = str(folder / "steps.log")
        self.service = Service(Settings(**fields), self.log)
        self._output = (folder / "serve.log").open("ab")
        self._api = None

    def start(self):
        """Start the service and wait until a design has run."""
        self._serve()
        design_id = self.service.request_design(f"warm-up-{time.monotonic_ns()} none")
        self.service.wait(design_id, status=("succeeded",), seconds=120.0)

    def stop(self):
        """End the service; whichever of its processes are still there afterwards."""
        self._api.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._api.wait(30.0)
        deadline = time.monotonic() + 10.0
        while (left := self._processes()) and time.monotonic() < deadline:
            time.sleep(0.1)
        words = [" ".join(process.cmdline()) for process in left]
        for process in left:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        self._output.close()
        self.service.database.dispose()
        if self._has_disk:
            subprocess.run(["umount", "--lazy", self.data], check=True)
        return words

    def run(self, name, fault, place):
        """One design with one fault in one place: what of the promises does not hold."""
        self._wait_for_workers()
        design_id = self.service.request_design(f"{name} {place}")
        if place == "start":
            self.service.wait_for(lambda: self.service.job(design_id).status != "queued")
        elif place != "queued":
            self.service.wait_for_step(f"begin:{name}.{place}.0")
        getattr(self, "_" + fault.replace("-", "_"))(lambda: self.service.let_go(f"{name}.{place}.0"), f"{name}.{place}.0")
        try:
            job = self.service.wait(design_id, seconds=90.0)
        except AssertionError:
            job = self.service.job(design_id)
            return [f"has not ended: {job.status} {job.stage} attempt {job.attempt} worker {job.worker} {design_id}"]
        return list(self._broken(name, place, design_id, job))

    def _broken(self, name, place, design_id, job):
        """What must hold of a design that has ended."""
        if job.status != "succeeded":
            yield f"ended as {job.status}: {job.problem}"
            return
        ends = [event for event in self.service.events(design_id) if event.data["status"] not in ("queued", "running")]
        if len(ends) != 1:
            yield f"ended {len(ends)} times"
        design = self.service.design(design_id)
        document = {file.path: file.sha256 for file in self._files(design_id)}
        content = self.service.artifacts.get(document["design.json"])
        if design.outcome != "complete" or content != b'{"status": "complete", "total": %d}' % total():
            yield f"came to {design.outcome} {content!r} instead of {total()}"
        steps = executed(self.log)
        for step in steps_of(name):
            ended, in_flight = steps.count(f"end:{step}"), step.startswith(f"{name}.{place}.") or place in ("queued", "start")
            if ended < 1 or (ended > 1 and not in_flight) or ended > 3:
                yield f"the step {step} ended {ended} times"

    def _files(self, design_id):
        from gripwright.store.models import DesignFileRow

        with self.service.database.read_sessions() as session:
            return session.query(DesignFileRow).filter(DesignFileRow.design_id == design_id).all()

    def leftovers(self):
        """Temporary files that nobody will ever complete."""
        return [str(path) for path in self.data.rglob("*.part")]

    # Faults. Each lets the waiting step go, which notes that it ended.

    def _kill_worker(self, let_go, step):
        for worker in self._workers_of(step):
            worker.kill()
        let_go()

    def _kill_child(self, let_go, step):
        pids = [line.split(":")[2] for line in executed(self.log) if line.startswith(f"pid:{step}:")]
        for pid in pids[-1:]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)
        let_go()

    def _kill_api(self, let_go, step):
        self._api.kill()
        self._api.wait()
        let_go()
        self._serve()

    def _stop_worker(self, let_go, step):
        stopped = self._workers_of(step)
        for worker in stopped:
            worker.suspend()
        let_go()
        self.service.wait_for(lambda: not any(worker.is_running() for worker in stopped), 60.0)

    def _disk_full(self, let_go, step):
        ballast = self.data / "ballast"
        with contextlib.suppress(OSError), ballast.open("wb", buffering=0) as file:
            while True:
                file.write(bytes(4096))
        let_go()
        time.sleep(1.5)
        ballast.unlink()

    def _database_locked(self, let_go, step, name="gripwright.db"):
        connection = sqlite3.connect(self.data / name, isolation_level=None, timeout=30.0)
        connection.execute("BEGIN IMMEDIATE")
        let_go()
        time.sleep(4.0)
        connection.execute("ROLLBACK")
        connection.close()

    def _engine_locked(self, let_go, step):
        self._database_locked(let_go, step, "jobs.sqlite")

    def _postgresql_restarted(self, let_go, step):
        threading.Timer(0.2, let_go).start()
        self.postgresql.stop()
        time.sleep(0.5)
        self.postgresql.start()
        self.service.database.dispose()

    def _clock_forward(self, let_go, step):
        self._jump(let_go, _CLOCK_JUMP_S)

    def _clock_back(self, let_go, step):
        self._jump(let_go, -_CLOCK_JUMP_S)

    def _jump(self, let_go, offset_s):
        self._set_clock(offset_s)
        let_go()
        time.sleep(1.0)
        self._set_clock(0)

    def _set_clock(self, offset_s):
        fresh = self._clock_file.with_suffix(".new")
        fresh.write_text(f"{offset_s:+d}\n")
        fresh.replace(self._clock_file)

    # Processes.

    def _serve(self):
        command = [sys.executable, "-c", "import fake_serve; fake_serve.main()"]
        self._api = subprocess.Popen(command, env=self._environment, stdout=self._output, stderr=self._output)

    def _processes(self):
        """Every process that works on this data folder."""
        found = []
        for process in psutil.process_iter():
            with contextlib.suppress(psutil.Error):
                if process.environ().get("GRIPWRIGHT_DATA") == str(self.data) and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
        return found

    def _workers(self):
        workers = []
        for process in self._api_children():
            with contextlib.suppress(psutil.Error):  # it may end in this very moment
                if process.cmdline()[-1:] == [WORKER[-1]]:
                    workers.append(process)
        return workers

    def _api_children(self):
        return psutil.Process(self._api.pid).children()

    def _wait_for_workers(self):
        self.service.wait_for(self._workers)

    def _workers_of(self, step):
        """The worker in which a step runs, or else the first."""
        pids = [int(line.split(":")[2]) for line in executed(self.log) if line.startswith(f"pid:{step}:")]
        with contextlib.suppress(psutil.Error, IndexError):
            ancestors = {process.pid for process in psutil.Process(pids[-1]).parents()}
            return [worker for worker in self._workers() if worker.pid in ancestors]
        return self._workers()[:1]


def _wall_clock(folder):
    """The library that moves the clock, compiled: as many processes as load it."""
    library = folder / "wall_clock.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", library, _HERE / "wall_clock.c", "-ldl"], check=True)
    return str(library)


def can_fill_disks():
    return os.geteuid() == 0 and shutil.which("mount") is not None
