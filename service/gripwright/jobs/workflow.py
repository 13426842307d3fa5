"""One attempt of a design from its snapshot to its end, whatever engine carries it."""

import json
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar, cast

from gripwright.design.plan import Plan, plan_of
from gripwright.design.records import OwnTypes, loads
from gripwright.design.runner import Ref, Runner
from gripwright.design.toolbox import PluginVersion
from gripwright.domain.assembly import AssemblyTask
from gripwright.domain.errors import Cancelled, GripwrightError
from gripwright.domain.gripper import Actuator
from gripwright.jobs.engine import DesignJobs, PassingFailure, may_heal, problem_of
from gripwright.jobs.steps import Workshop, resolve_plan
from gripwright.jobs.stopping import StopSign
from gripwright.jobs.tally import Tally
from gripwright.store.engines import PASSING_ERRORS
from gripwright.store.jobs import DesignSnapshot

if TYPE_CHECKING:
    from gripwright.tracer import Tracer

log = logging.getLogger(__name__)

T = TypeVar("T")

Pipeline = Callable[[AssemblyTask, tuple[Actuator, ...], Plan, Runner], Ref]
"""`design.pipeline.design`: the calculation as a whole; the ref of its result."""

Resolved = dict[str, Any]
"""A checked plan and the exact plug-ins it means, as JSON: {"plan", "versions"}."""

_DEFECT: dict[str, Any] = {
    "code": "internal",
    "title": "internal",
    "detail": "the design failed for a reason that is not in its input; the log has it",
    "stage": None,
    "plugin": None,
    "errors": [],
}


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOffice:
    """What running a design takes: the database, the workshop and the calculation; and where it is counted and told."""

    jobs: DesignJobs
    tally: Tally
    workshop: Workshop
    pipeline: Pipeline
    tracer: "Tracer | None" = None

    def resolve(self, design_id: str, cancelled: Callable[[], bool]) -> Resolved:
        """The plan of a design and its plug-ins, checked."""
        plan, versions = resolve_plan(self.workshop, plan_of(self.jobs.snapshot(design_id).options), cancelled=cancelled)
        return {"plan": plan.model_dump(mode="json"), "versions": versions}


def run_design(
    office: DesignOffice,
    design_id: str,
    attempt: int,
    *,
    worker: str,
    resolve: Callable[[], Resolved],
    runner: Callable[[Plan, dict[str, PluginVersion]], Runner],
    before_end: Callable[[], None],
) -> None:
    """Run an attempt to its end and record how it ended. Ending twice changes nothing, so it may be run again after a crash.

    `before_end` returns where the end is to be recorded.
    """
    jobs = office.jobs
    if not persistently(lambda: jobs.start(design_id, attempt, worker)):
        return
    end = _attempted(office, design_id, attempt, resolve, runner)
    before_end()
    persistently(end)


def _attempted(
    office: DesignOffice,
    design_id: str,
    attempt: int,
    resolve: Callable[[], Resolved],
    runner: Callable[[Plan, dict[str, PluginVersion]], Runner],
) -> Callable[[], None]:
    """Run an attempt; what records its end."""
    jobs = office.jobs
    try:
        resolved = resolve()
        plan = Plan(**resolved["plan"])
        files = _compute(office, jobs.snapshot(design_id), plan, runner(plan, resolved["versions"]))
        document = json.loads(files["design.json"])
        stored = {path: office.workshop.artifacts.put(data) for path, data in files.items()}
        StopSign(jobs, design_id, attempt).check()
        return lambda: jobs.finish(design_id, attempt, document["status"], document, stored)
    except Cancelled:
        return lambda: jobs.cancelled(design_id, attempt)
    except GripwrightError as error:
        problem, step = problem_of(error), cast("str | None", error.context.get("step"))
        end = jobs.put_back if may_heal(error) else jobs.fail
        return lambda: end(design_id, attempt, problem, step=step)
    except PASSING_ERRORS as error:
        log.warning("design %s: %s", design_id, error)
        failure = PassingFailure(f"the database or the disk failed: {type(error).__name__}")
        return lambda: jobs.put_back(design_id, attempt, problem_of(failure))
    except Exception:
        log.exception("design %s failed", design_id)
        return lambda: jobs.fail(design_id, attempt, _DEFECT)


def persistently(act: Callable[[], T], *, pause_s: float = 0.5, pause_max_s: float = 10.0) -> T:
    """What `act` returns, tried until the database and the disk let it: how a design ended must not be lost."""
    while True:
        try:
            return act()
        except PASSING_ERRORS as error:
            log.warning("tried again in %.1f s: %s", pause_s, error)
        time.sleep(pause_s)
        pause_s = min(2.0 * pause_s, pause_max_s)


def _compute(office: DesignOffice, snapshot: DesignSnapshot, plan: Plan, runner: Runner) -> dict[str, bytes]:
    """The files of the design folder by their paths."""
    types, artifacts = OwnTypes(), office.workshop.artifacts
    task = loads(artifacts.get(snapshot.task_sha256), types)
    actuators = loads(artifacts.get(snapshot.actuators_sha256), types)
    result = office.pipeline(task, actuators, plan, runner)
    (folder,) = runner.map("export", [{"result": {"ref": result}}])
    files: dict[str, bytes] = runner.get(folder)
    return files
