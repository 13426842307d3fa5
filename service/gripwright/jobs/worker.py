"""A worker process: takes queued designs to the job engine, and cleans up after workers that died."""

import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn

from gripwright.jobs.child import preload
from gripwright.jobs.dbos_engine import DbosEngine
from gripwright.jobs.deliveries import DeliveryLoop
from gripwright.jobs.engine import DesignJobs, JobEngine, StepFailure, problem_of
from gripwright.jobs.hosts import Lease, Watch, join_workers
from gripwright.jobs.housekeeping import Housekeeping
from gripwright.jobs.steps import Workshop
from gripwright.jobs.supervisor import LIFELINE
from gripwright.jobs.workflow import DesignOffice
from gripwright.settings import Settings
from gripwright.store.jobs import open_design_jobs

if TYPE_CHECKING:
    from types import FrameType

log = logging.getLogger(__name__)

_DISPATCH_S = 0.2
_SWEEP_S = 2.0
_DESIGNS_A_LOOK = 100


def run_worker(settings: Settings) -> NoReturn:
    """Work until SIGTERM or SIGINT, then end the process. What runs then is continued by the next worker."""
    from gripwright.design.pipeline import design

    preload()
    workshop = Workshop.of(settings)
    office = DesignOffice(jobs=open_design_jobs(settings), workshop=workshop, pipeline=design)
    deliveries = DeliveryLoop(settings)
    deliveries.start()
    work(office, settings)
    deliveries.stop()
    logging.shutdown()
    os._exit(0)  # threads of the engine wait for steps that the next worker will continue


def work(office: DesignOffice, settings: Settings) -> None:
    """Run the designs of an office until the process is told to end."""
    stop = threading.Event()
    _on_end(stop.set)
    lease, watch = join_workers(settings)
    engine = DbosEngine(office, database_url=jobs_database_url(settings), executor=lease.id)
    housekeeping = Housekeeping(settings, lease.id)
    lease.start()
    engine.start()
    housekeeping.start()
    log.info("worker %s is ready", lease.id)
    next_sweep_s = time.monotonic()
    while not stop.wait(_DISPATCH_S):
        dispatch(office.jobs, engine)
        if time.monotonic() >= next_sweep_s:
            sweep(office.jobs, engine, lease, watch)
            next_sweep_s = time.monotonic() + _SWEEP_S
    housekeeping.stop()
    engine.stop()
    lease.stop()


def dispatch(jobs: DesignJobs, engine: JobEngine) -> None:
    """Give what is queued to the engine. Two workers may do it at the same time: to submit twice changes nothing."""
    for design_id, attempt in jobs.undispatched(_DESIGNS_A_LOOK):
        engine.submit(design_id, attempt)
        jobs.mark_dispatched(design_id, attempt)


def sweep(jobs: DesignJobs, engine: JobEngine, lease: Lease, watch: Watch) -> None:
    """Continue what dead workers left behind, and fail what nobody will ever continue."""
    at_work = engine.at_work()  # before the look at who lives: whoever begins something has a lease by then
    lease.steps = at_work.get(lease.id, 0)
    living = watch.living()
    if lease.id not in living:
        lease.lose()
        return
    for executor in at_work.keys() - living:
        engine.take_over(executor)
    for design_id, attempt in jobs.running():
        if engine.state(design_id, attempt) != "active":
            error = StepFailure("its worker was replaced by another version while it ran: retry continues from what is stored")
            jobs.fail(design_id, attempt, problem_of(error))


def jobs_database_url(settings: Settings) -> str:
    """Where the engine keeps its own tables: a file of its own, so that its polling never blocks the service's."""
    return settings.jobs_database_url or f"sqlite:///{settings.data_dir / 'jobs.sqlite'}"


def _on_end(end: Callable[[], None]) -> None:
    """Call `end` at SIGTERM and SIGINT, and where the supervisor dies."""

    def handler(number: int, frame: "FrameType | None") -> None:
        del number, frame
        end()

    signal.signal(signal.SIGTERM, handler)
    signal.signal(signal.SIGINT, handler)

    def watch_lifeline() -> None:
        sys.stdin.buffer.read()
        end()

    if LIFELINE in os.environ:
        threading.Thread(target=watch_lifeline, daemon=True, name="lifeline").start()
