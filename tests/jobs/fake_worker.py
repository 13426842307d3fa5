"""A worker process with a calculation made for tests; everything else is real."""

import dataclasses
import importlib
import logging
import multiprocessing
import os

from gripwright.jobs.child import preload
from gripwright.jobs.steps import Workshop
from gripwright.jobs.worker import work
from gripwright.jobs.workflow import DesignOffice
from gripwright.settings import load_settings
from gripwright.store.jobs import open_design_jobs


def main():
    logging.basicConfig(level=logging.INFO)
    multiprocessing.get_context("forkserver").set_forkserver_preload(["fake_preload"])  # lighter than the real one
    preload()
    settings = load_settings()
    calculation = importlib.import_module(os.environ.get("FAKE_CALCULATION", "fake_calculation"))
    workshop = dataclasses.replace(Workshop.of(settings), stages_at=calculation.STAGES_AT)
    work(DesignOffice(jobs=open_design_jobs(settings), workshop=workshop, pipeline=calculation.design), settings)
    os._exit(0)
