"""A worker process: takes queued designs to the job engine, and cleans up after workers that died."""

import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn

from gripwright.jobs.dbos_engine import DbosEngine
from gripwright.jobs.deliveries import DeliveryLoop
from gripwright.jobs.engine import DesignJobs, JobEngine, PassingFailure, problem_of
from gripwright.jobs.fork_server import preload
from gripwright.jobs.hosts import Lease, Watch, join_workers
from gripwright.jobs.housekeeping import Housekeeping
from gripwright.jobs.steps import Workshop
from gripwright.jobs.stopping import deadline_exceeded
from gripwright.jobs.supervisor import LIFELINE, beat
from gripwright.jobs.tally import Tally
from gripwright.jobs.workflow import DesignOffice
from gripwright.logs import of_this_process, take_over
from gripwright.settings import Settings
from gripwright.store.claims import DesignLimits
from gripwright.store.engines import PASSING_ERRORS, Database
from gripwright.store.jobs import open_design_jobs
from gripwright.traces import tracer_from_environment

if TYPE_CHECKING:
    from types import FrameType

log = logging.getLogger(__name__)

_DISPATCH_S = 0.2
_SWEEP_S = 2.0
_CLEARING_S = 3600.0
_NICENESS = 10  # computing leaves the cores to whatever answers somebody who waits: the service, a database


def run_worker(settings: Settings) -> NoReturn:
    """Work until SIGTERM or SIGINT, then end the process. What runs then is continued by the next worker."""
    from gripwright.design.pipeline import design

    os.nice(_NICENESS)
    preload()
    workshop = Workshop.of(settings)
    tally = Tally(Database(settings.resolved_database_url))
    jobs, tracer = open_design_jobs(settings), tracer_from_environment()
    office = DesignOffice(jobs=jobs, tally=tally, workshop=workshop, pipeline=design, tracer=tracer)
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
    beat()
    limits = DesignLimits(per_worker=settings.designs_per_worker, per_client=settings.designs_per_client)
    lease, watch = join_workers(settings)
    engine = DbosEngine(office, database_url=jobs_database_url(settings), executor=lease.id)
    housekeeping = Housekeeping(settings, lease.id)
    lease.start()
    engine.start()
    office.tally.start()
    take_over("dbos")
    of_this_process(worker=lease.id)
    housekeeping.start()
    log.info("worker %s is ready", lease.id)
    next_sweep_s = next_clearing_s = time.monotonic()
    while not stop.wait(_DISPATCH_S):
        try:
            dispatch(office.jobs, engine, lease.id, limits)
            if time.monotonic() >= next_sweep_s:
                next_sweep_s = time.monotonic() + _SWEEP_S
                sweep(office.jobs, engine, lease, watch)
            if time.monotonic() >= next_clearing_s:
                next_clearing_s = time.monotonic() + _CLEARING_S
                office.jobs.forget(settings.event_days)
        except PASSING_ERRORS as error:
            log.warning("nothing is taken from the queue now: %s", error)
    housekeeping.stop()
    engine.stop()
    office.tally.stop()
    if office.tracer is not None:
        office.tracer.stop()
    lease.stop()


def dispatch(jobs: DesignJobs, engine: JobEngine, worker: str, limits: DesignLimits) -> None:
    """Begin as many of the designs that wait as may run now."""
    claimed = jobs.claim(worker, limits)
    if claimed:
        engine.pace(busy=True)
    for design_id, attempt in claimed:
        engine.submit(design_id, attempt)


def sweep(jobs: DesignJobs, engine: JobEngine, lease: Lease, watch: Watch) -> None:
    """Continue what dead workers left behind, and end what is late or what nobody will ever continue."""
    watched = jobs.watched()
    engine.pace(busy=bool(watched))
    at_work = engine.at_work() if watched else {}  # before the look at who lives: whoever begins something has a lease by then
    lease.steps = at_work.get(lease.id, 0)
    living = watch.living()
    if lease.id not in living:
        lease.lose()
        return
    for executor in at_work.keys() - living:
        engine.take_over(executor)
    for job in watched:
        if job.is_late:
            jobs.fail(job.design_id, job.attempt, problem_of(deadline_exceeded()))
        elif job.status == "queued":
            engine.submit(job.design_id, job.attempt)  # its worker died before it did
        elif engine.state(job.design_id, job.attempt) != "active":
            failure = PassingFailure("its worker ended, or was replaced by another version")
            jobs.put_back(job.design_id, job.attempt, problem_of(failure))


def jobs_database_url(settings: Settings) -> str:
    """Where the engine keeps its own tables: a file of its own, so that its polling never blocks the service's."""
    return settings.jobs_database_url or f"sqlite:///{settings.data_dir / 'jobs.sqlite'}"


def _on_end(end: Callable[[], None]) -> None:
    """Call `end` at SIGTERM and SIGINT, and where the supervisor dies."""

    ended = threading.Event()

    def handler(number: int, frame: "FrameType | None") -> None:
        del frame
        if ended.is_set():
            os._exit(128 + number)  # told twice
        ended.set()
        end()

    signal.signal(signal.SIGTERM, handler)
    signal.signal(signal.SIGINT, handler)

    def watch_lifeline() -> None:
        sys.stdin.buffer.read()
        end()

    if LIFELINE in os.environ:
        threading.Thread(target=watch_lifeline, daemon=True, name="lifeline").start()
