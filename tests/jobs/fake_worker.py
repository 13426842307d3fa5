"""A worker process with a calculation made for tests; everything else is real."""

import dataclasses
import importlib
import logging
import multiprocessing
import os

from gripwright.jobs.fork_server import preload
from gripwright.jobs.steps import Workshop
from gripwright.jobs.tally import Tally
from gripwright.jobs.worker import work
from gripwright.jobs.workflow import DesignOffice
from gripwright.settings import load_settings
from gripwright.store.engines import Database
from gripwright.store.jobs import open_design_jobs
from gripwright.traces import tracer_from_environment


def main():
    logging.basicConfig(level=logging.INFO)
    multiprocessing.get_context("forkserver").set_forkserver_preload(["fake_preload"])  # lighter than the real one
    preload()
    settings = load_settings()
    calculation = importlib.import_module(os.environ.get("FAKE_CALCULATION", "fake_calculation"))
    workshop = dataclasses.replace(Workshop.of(settings), stages_at=calculation.STAGES_AT)
    tally = Tally(Database(settings.resolved_database_url))
    jobs, tracer = open_design_jobs(settings), tracer_from_environment()
    work(DesignOffice(jobs=jobs, tally=tally, workshop=workshop, pipeline=calculation.design, tracer=tracer), settings)
    os._exit(0)
