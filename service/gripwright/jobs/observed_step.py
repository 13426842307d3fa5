"""A step that is run and seen: counted and timed by how it ended."""

import time
from collections.abc import Callable

from structlog.contextvars import bound_contextvars

from gripwright.domain.errors import GripwrightError
from gripwright.jobs.child import Progress
from gripwright.jobs.steps import StepCall, Workshop, run_step
from gripwright.jobs.tally import Tally
from gripwright.jobs.workflow import DesignOffice
from gripwright.store.step_stats import COMPUTED


def run_observed_step(
    office: DesignOffice,
    design_id: str,
    attempt: int,
    call: StepCall,
    *,
    on_progress: Progress,
    cancelled: Callable[[], bool],
) -> None:
    """`run_step`, counted; what is logged meanwhile says for what."""
    with bound_contextvars(design=design_id, attempt=attempt, stage=call["stage"]):
        _run_counted(office.tally, office.workshop, call, on_progress, cancelled)


def _run_counted(tally: Tally, workshop: Workshop, call: StepCall, on_progress: Progress, cancelled: Callable[[], bool]) -> None:
    started_s = time.monotonic()
    try:
        was_stored = not run_step(workshop, call, on_progress=on_progress, cancelled=cancelled)
    except GripwrightError as error:
        tally.step_ended(call["stage"], error.code, time.monotonic() - started_s)
        raise
    if was_stored:
        tally.steps_stored(call["stage"], 1)
    else:
        tally.step_ended(call["stage"], COMPUTED, time.monotonic() - started_s)
