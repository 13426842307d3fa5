"""A service without HTTP: a database, requests for designs, and real worker processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from fake_calculation import executed

from gripwright.design.records import dumps
from gripwright.domain.assembly import AssemblyTask
from gripwright.settings import Settings
from gripwright.store.columns import new_id, utc_now
from gripwright.store.designs import DesignRepository, JobRepository, JobTerms
from gripwright.store.engines import Database
from gripwright.store.migrate import migrate
from gripwright.store.models import DesignRow, JobEventRow, JobRow, ProductRow
from gripwright.store.storage import open_artifacts
from plugin_factory import ALL_KINDS, FAKE_OPTIONS, install


class Service:
    def __init__(self, settings: Settings, log: str):
        self._environment = dict(os.environ)
        settings.data_dir.mkdir(parents=True, exist_ok=True)
        self.settings, self.log = settings, log
        self.database = Database(settings.resolved_database_url)
        migrate(self.database)
        self.artifacts = open_artifacts(settings.resolved_storage_url)
        self.workers = []
        self._product_id = self._add_product()

    def request_design(self, words: str, **terms) -> str:
        """Queue a design; `words` say what its steps do, see `fake_calculation.design`."""
        task = AssemblyTask(part_number="P", revision="A", name=words, components=(), obstacles=(), operations=())
        design = DesignRow(
            id=new_id(utc_now()),
            product_id=self._product_id,
            product_version=1,
            task_sha256=self.artifacts.put(dumps(task)),
            actuators_sha256=self.artifacts.put(dumps(())),
            options=FAKE_OPTIONS,
            outcome=None,
            created_at=utc_now(),
        )
        with self.database.write_sessions.begin() as session:
            DesignRepository(session).add(design, utc_now(), JobTerms(**terms))
        return design.id

    def start_worker(self, *prefix):
        """A worker process; `prefix` is a command that runs it elsewhere."""
        command = [*prefix, sys.executable, "-c", "import fake_worker; fake_worker.main()"]
        worker = subprocess.Popen(command, env=self._environment)
        self.workers.append(worker)
        return worker

    def kill_worker(self, worker=None):
        worker = worker or self.workers[-1]
        worker.send_signal(signal.SIGKILL)
        worker.wait()

    def stop(self):
        for worker in self.workers:
            worker.kill()
            worker.wait()
        self.database.dispose()

    def job(self, design_id: str) -> JobRow:
        with self.database.read_sessions() as session:
            return session.get_one(JobRow, design_id)

    def change(self, design_id: str, action: str) -> None:
        """Ask for `cancel` or `retry` as the API does."""
        with self.database.write_sessions.begin() as session:
            jobs = JobRepository(session)
            getattr(jobs, action)(jobs.get(design_id), utc_now())

    def design(self, design_id: str) -> DesignRow:
        with self.database.read_sessions() as session:
            return session.get_one(DesignRow, design_id)

    def events(self, design_id: str):
        with self.database.read_sessions() as session:
            return session.query(JobEventRow).filter(JobEventRow.job_id == design_id).order_by(JobEventRow.id).all()

    def wait(self, design_id: str, *, status=("succeeded", "failed", "cancelled"), seconds: float = 60.0) -> JobRow:
        return self.wait_for(lambda: (job := self.job(design_id)).status in status and job, seconds)

    def wait_for_step(self, line: str) -> None:
        self.wait_for(lambda: line in executed(self.log))

    def wait_for(self, condition, seconds: float = 60.0):
        deadline = time.monotonic() + seconds
        while not (value := condition()):
            assert time.monotonic() < deadline, "waited in vain"
            time.sleep(0.02)
        return value

    def let_go(self, name: str) -> None:
        """End the step that waits under this name."""
        Path(self.log).with_name(f"go-{name}").touch()

    def _add_product(self) -> str:
        row = ProductRow(
            id=new_id(utc_now()), part_number="P", revision="A", name="", content_sha256="0" * 64, task_sha256="0" * 64,
            manifest={}, warnings=[], version=1, created_at=utc_now(), updated_at=utc_now(),
        )  # fmt: skip
        with self.database.write_sessions.begin() as session:
            session.add(row)
        return row.id


def make_service(folder, monkeypatch, **variables):
    """A service without a worker, in a folder; `variables` are settings in the environment, by field name in capitals."""
    site = folder / "site"
    site.mkdir()
    install(site, "gripwright-fakes", ALL_KINDS)
    here = os.path.dirname(__file__)
    paths = [str(site), here, os.path.dirname(here), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    monkeypatch.setenv("FAKE_LOG", str(folder / "steps.log"))
    monkeypatch.setenv("GRIPWRIGHT_DATA", str(folder / "data"))
    monkeypatch.setenv("GRIPWRIGHT_PLUGINS_ALLOW", '["gripwright-fakes"]')
    for name, value in variables.items():
        monkeypatch.setenv(f"GRIPWRIGHT_{name}", value)
    return Service(Settings(), str(folder / "steps.log"))
