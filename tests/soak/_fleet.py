"""What the long tests of several workers share: a database with many small, different, real products, and worker processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import trimesh

from gripwright.cad.manifest import manifest_of
from gripwright.cad.package import Product
from gripwright.design.records import dumps
from gripwright.domain.shape import Mesh
from gripwright.jobs.products import register_product
from gripwright.settings import Settings
from gripwright.store.columns import new_id, utc_now
from gripwright.store.designs import DesignRepository
from gripwright.store.engines import Database
from gripwright.store.migrate import migrate
from gripwright.store.models import DesignRow, JobEventRow, JobRow
from gripwright.store.seed import seed_actuators
from gripwright.store.storage import open_artifacts
from gripwright.store.workers import WorkerRepository

OPTIONS = {"plan": "paper", "actuators": "paper"}
WORKER = (sys.executable, "-m", "gripwright.cli", "worker")


def end_as_ctrl_c() -> None:
    """Let SIGTERM, as of `timeout`, unwind what was started, too."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)


class Fleet:
    """A service without HTTP, and its workers. `variables` are settings, with those that a client of the storage needs."""

    def __init__(self, folder: Path, variables: dict[str, str]) -> None:
        self.folder = folder
        self._environment = os.environ | variables | {"GRIPWRIGHT_DATA": str(folder / "data")}
        os.environ.update(variables)
        self.settings = Settings(data_dir=folder / "data")
        self.settings.data_dir.mkdir(parents=True, exist_ok=True)
        self.database = Database(self.settings.resolved_database_url)
        migrate(self.database)
        self.artifacts = open_artifacts(self.settings.resolved_storage_url)
        self.workers: list[subprocess.Popen[bytes]] = []

    def request(self, count: int, first: int = 0) -> list[str]:
        """Queue designs of products that have nothing in common."""
        actuators_sha256 = self.artifacts.put(dumps(seed_actuators()))
        ids = []
        for number in range(first, first + count):
            with self.database.write_sessions.begin() as session:
                product, _ = register_product(session, self.artifacts, peg_on_plate(number), utc_now())
                design = DesignRow(
                    id=new_id(utc_now()),
                    product_id=product.id,
                    product_version=1,
                    task_sha256=product.task_sha256,
                    actuators_sha256=actuators_sha256,
                    options=OPTIONS,
                    outcome=None,
                    created_at=utc_now(),
                )
                DesignRepository(session).add(design, utc_now())
                ids.append(design.id)
        return ids

    def start_worker(self, *prefix: str) -> subprocess.Popen[bytes]:
        """A worker process; `prefix` is what runs it elsewhere."""
        log = (self.folder / f"worker-{len(self.workers)}.log").open("wb")
        command = [*prefix, *WORKER]
        worker = subprocess.Popen(command, env=self._environment, stdout=log, stderr=log, start_new_session=True)
        self.workers.append(worker)
        return worker

    def wait_for_workers(self, count: int) -> None:
        """Wait until so many hold a lease."""
        self.wait_for(lambda: self._living() == count, 120.0)

    def wait(self, ids: list[str], seconds: float) -> dict[str, str]:
        """Wait until the designs have ended; their statuses."""
        self.wait_for(lambda: all(status not in ("queued", "running") for status in self.statuses(ids).values()), seconds)
        return self.statuses(ids)

    def wait_for(self, condition, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, f"waited in vain; the logs are in {self.folder}"
            time.sleep(0.2)

    def statuses(self, ids: list[str]) -> dict[str, str]:
        with self.database.read_sessions() as session:
            return {design_id: session.get_one(JobRow, design_id).status for design_id in ids}

    def endings(self, design_id: str) -> list[str]:
        """The statuses that a design went through after it ran."""
        with self.database.read_sessions() as session:
            events = session.query(JobEventRow).filter(JobEventRow.job_id == design_id, JobEventRow.kind == "status").all()
            return [event.data["status"] for event in events if event.data["status"] not in ("queued", "running")]

    def cpu_s(self) -> float:
        """Processor time of the workers and all that they started, ended or not."""
        processes = [process for worker in self.workers for process in _family(worker.pid)]
        return sum(sum(process.cpu_times()[:4]) for process in processes)

    def stop(self) -> None:
        for worker in self.workers:
            worker.send_signal(signal.SIGTERM)
        for worker in self.workers:
            try:
                worker.wait(15)
            except subprocess.TimeoutExpired:
                worker.kill()
                worker.wait()
        self.database.dispose()

    def _living(self) -> int:
        with self.database.read_sessions() as session:
            return len(WorkerRepository(session).all())


def peg_on_plate(number: int) -> Product:
    """A peg that is set down on a plate; each number has dimensions of its own."""
    plate = trimesh.creation.box((90.0 + 0.3 * number, 40.0, 8.0))
    peg = trimesh.creation.cylinder(radius=8.0 + 0.1 * number, height=30.0 + 0.2 * number, sections=48)
    component = {"revision": "A", "units": "mm", "pose": _pose(0.0)}
    document = {
        "part_number": f"soak-{number}",
        "revision": "A",
        "name": "Peg on a plate",
        "components": [{"id": name, "part_number": name, "file": f"{name}.stl", **component} for name in ("plate", "peg")],
        "operations": [
            {"id": "set-peg", "active": ["peg"], "passive": ["plate"], "pose_before": _pose(120.0), "pose_after": _pose(0.0)}
        ],
    }
    meshes = {"plate": _mesh(plate, -4.0), "peg": _mesh(peg, peg.extents[2] / 2.0)}
    return Product(manifest=manifest_of(document), meshes=meshes, obstacle_meshes={})


def _mesh(part: trimesh.Trimesh, z_mm: float) -> Mesh:
    return Mesh(vertices_mm=np.array(part.vertices) + np.array([0.0, 0.0, z_mm]), faces=np.array(part.faces))


def _pose(z_mm: float) -> list[list[float]]:
    return [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, z_mm], [0.0, 0.0, 0.0, 1.0]]


def _family(pid: int) -> list[psutil.Process]:
    try:
        process = psutil.Process(pid)
        return [process, *process.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []
