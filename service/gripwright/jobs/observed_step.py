"""Designs and steps that are run and seen: counted and timed by how they ended, and told as spans of one trace."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from structlog.contextvars import bound_contextvars

from gripwright.domain.errors import GripwrightError
from gripwright.jobs.child import Progress
from gripwright.jobs.steps import Computation, StepCall, run_step
from gripwright.jobs.workflow import DesignOffice
from gripwright.store.step_stats import COMPUTED
from gripwright.traces import TracePlace, place_of


@contextmanager
def observed_design(office: DesignOffice, design_id: str, attempt: int) -> Iterator[None]:
    """What is logged meanwhile says for which design; at the end its span is told, from when it was started first."""
    with bound_contextvars(design=design_id, attempt=attempt):
        yield
    place = _place_of_design(office, design_id, attempt)
    if office.tracer is None or place is None:
        return
    told = office.jobs.told(design_id)
    attributes = {"gripwright.design": design_id, "gripwright.attempt": attempt, "gripwright.status": told.status}
    end_ns = time.time_ns()
    start_ns = end_ns if told.started_at is None else int(told.started_at.timestamp() * 1e9)
    if told.code is not None:
        attributes["error.type"] = told.code
    office.tracer.tell("design", place, start_ns, end_ns, attributes, error=told.code)


def observed_hits(office: DesignOffice, design_id: str, attempt: int, stage: str, steps: int) -> None:
    """So many steps of a stage were stored already."""
    office.tally.steps_stored(stage, steps)
    place = _place_of_design(office, design_id, attempt) if steps else None
    if office.tracer is not None and place is not None:
        now_ns = time.time_ns()
        attributes = {**_about(design_id, attempt, stage), "gripwright.cache_hit": True, "gripwright.steps": steps}
        office.tracer.tell(f"step {stage}", place.child(), now_ns, now_ns, attributes)


def run_observed_step(
    office: DesignOffice,
    design_id: str,
    attempt: int,
    call: StepCall,
    *,
    on_progress: Progress,
    cancelled: Callable[[], bool],
) -> None:
    """`run_step`, counted and told; what is logged meanwhile says for what."""
    started_s, start_ns, stage = time.monotonic(), time.time_ns(), call["stage"]
    computation, code = None, None
    with bound_contextvars(design=design_id, attempt=attempt, stage=stage):
        try:
            computation = run_step(office.workshop, call, on_progress=on_progress, cancelled=cancelled)
        except GripwrightError as error:
            code = error.code
            raise
        finally:
            if code is None and computation is None:
                office.tally.steps_stored(stage, 1)
            else:
                office.tally.step_ended(stage, code or COMPUTED, time.monotonic() - started_s)
            _tell_step(office, design_id, attempt, call, start_ns, computation, code)


def _tell_step(
    office: DesignOffice,
    design_id: str,
    attempt: int,
    call: StepCall,
    start_ns: int,
    computation: Computation | None,
    code: str | None,
) -> None:
    """The span of a step, and below it that of its child process, which has no tracer of its own."""
    above = _place_of_design(office, design_id, attempt)
    if office.tracer is None or above is None:
        return
    place, stage = above.child(), call["stage"]
    attributes = {**_about(design_id, attempt, stage), "gripwright.cache_hit": computation is None and code is None}
    for name, version in call["versions"].items():
        attributes[f"gripwright.plugin.{name}"] = f"{version['distribution']} {version['version']}"
    if code is not None:
        attributes["error.type"] = code
    if computation is not None:
        spent = (computation["start_ns"], computation["end_ns"])
        office.tracer.tell(f"compute {stage}", place.child(), *spent, {"process.pid": computation["pid"]})
    office.tracer.tell(f"step {stage}", place, start_ns, time.time_ns(), attributes, error=code)


def _place_of_design(office: DesignOffice, design_id: str, attempt: int) -> TracePlace | None:
    """None where nothing is traced, so that nothing is read for it."""
    if office.tracer is None:
        return None
    request = place_of(office.jobs.told(design_id).traceparent or "")
    return None if request is None else request.child(f"{design_id}.{attempt}")


def _about(design_id: str, attempt: int, stage: str) -> dict[str, Any]:
    return {"gripwright.design": design_id, "gripwright.attempt": attempt, "gripwright.stage": stage}
