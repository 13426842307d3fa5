"""The job engine on DBOS Transact; the only file that knows it.

A design is a workflow of the queue `design`; each of its steps is a workflow of the queue `cpu` (one limited queue for both would
deadlock). What DBOS records is small JSON: results of steps are in the step store. A workflow that a killed process left
behind is run again by its successor: calls that DBOS recorded are not made again, steps that are stored are not computed again.
"""

import sqlite3
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dbos import DBOS, DBOSConfig, SetWorkflowID, WorkflowSerializationFormat, WorkflowStatusString

import gripwright
from gripwright.design.plan import Plan
from gripwright.design.runner import Ref
from gripwright.design.toolbox import PluginVersion
from gripwright.domain.errors import Cancelled, Fault, GripwrightError
from gripwright.jobs.child import Refused
from gripwright.jobs.engine import JobState, StepFailure, problem_of
from gripwright.jobs.observed_step import observed_design, observed_hits, run_observed_step
from gripwright.jobs.progress import Throttle, design_fraction
from gripwright.jobs.steps import StepCall, load_stages, step_call
from gripwright.jobs.workflow import DesignOffice, run_design

DESIGN_QUEUE, CPU_QUEUE = "design", "cpu"
_POLL_S = 0.1
_CANCEL_POLL_S = 0.25
_DESIGNS_A_WORKER = 4  # a design's own workflow only waits; its steps do the work
_STEP_RECOVERIES = 3  # a step that takes its whole worker down so often is given up
_QUEUED = WorkflowStatusString.ENQUEUED.value
_ACTIVE = (_QUEUED, WorkflowStatusString.PENDING.value, WorkflowStatusString.DELAYED.value)


class DbosEngine:
    """One process of the job engine. `executor` is the same after each restart of its slot, and of no other live process."""

    def __init__(self, office: DesignOffice, *, database_url: str, executor: str, steps_at_a_time: int = 1) -> None:
        self._office, self._steps_at_a_time = office, steps_at_a_time
        self._database_url = database_url
        config = DBOSConfig(
            name="gripwright",
            system_database_url=database_url,
            application_version=gripwright.__version__,
            executor_id=executor,
            log_level="WARNING",
        )
        DBOS(config=config)
        self._run_design, self._run_step = self._workflows()

    def start(self) -> None:
        """Begin to work, first on what a process of the same slot left behind."""
        _use_wal(self._database_url)
        DBOS.launch()
        DBOS.register_queue(DESIGN_QUEUE, worker_concurrency=_DESIGNS_A_WORKER, polling_interval_sec=_POLL_S)
        DBOS.register_queue(CPU_QUEUE, worker_concurrency=self._steps_at_a_time, polling_interval_sec=_POLL_S)

    def submit(self, design_id: str, attempt: int) -> None:
        """Run one attempt of a design; to submit it again changes nothing."""
        with SetWorkflowID(workflow_id(design_id, attempt)):
            DBOS.enqueue_workflow(DESIGN_QUEUE, self._run_design, design_id, attempt)

    def state(self, design_id: str, attempt: int) -> JobState:
        """Whether the engine still works on it."""
        status = DBOS.get_workflow_status(workflow_id(design_id, attempt))
        if status is None:
            return "unknown"
        alive = status.status in _ACTIVE and status.app_version == gripwright.__version__
        return "active" if alive else "ended"

    def take_over(self, executor: str) -> None:
        """Continue what a dead executor left behind."""
        DBOS._recover_pending_workflows([executor])  # the public way is a restart of that very executor

    def stop(self) -> None:
        """Take no more work; what runs is left to whoever starts next."""
        DBOS.destroy(workflow_completion_timeout_sec=0)

    def _workflows(self) -> tuple[Callable[[str, int], None], Callable[..., dict[str, Any] | None]]:
        @DBOS.workflow(
            name="step", max_recovery_attempts=_STEP_RECOVERIES, serialization_type=WorkflowSerializationFormat.PORTABLE
        )
        def step(design_id: str, attempt: int, call: StepCall, place: list[int]) -> dict[str, Any] | None:
            return self._compute(design_id, attempt, call, place)

        @DBOS.workflow(name="design", serialization_type=WorkflowSerializationFormat.PORTABLE)
        def design(design_id: str, attempt: int) -> None:
            with observed_design(self._office, design_id, attempt):
                run_design(
                    self._office,
                    design_id,
                    attempt,
                    resolve=lambda: _recorded("resolve", lambda: self._office.resolve(design_id)),
                    runner=lambda plan, versions: _DurableRunner(self._office, design_id, attempt, plan, versions, step),
                )

        return design, step

    def _compute(self, design_id: str, attempt: int, call: StepCall, place: list[int]) -> dict[str, Any] | None:
        """Run a step; None, or the problem it ended with."""
        jobs, (index, total) = self._office.jobs, place
        stages = list(load_stages(self._office.workshop.stages_at))
        report = Throttle(lambda fraction, stage, message: jobs.record_progress(design_id, attempt, fraction, stage, message))
        cancelled = _Cancellation(self._office, design_id)

        def asked_to_stop() -> bool:
            report.flush()
            return cancelled()

        def advance(fraction: float, message: str) -> None:
            report(design_fraction(stages, call["stage"], index + fraction, total), call["stage"], message)

        advance(0.0, "")
        try:
            if cancelled():
                raise Cancelled("the caller asked to stop")
            run_observed_step(self._office, design_id, attempt, call, on_progress=advance, cancelled=asked_to_stop)
        except GripwrightError as error:
            return problem_of(error)
        return None


class _DurableRunner:
    """A `Runner` inside the workflow of a design: what is not stored becomes a workflow of its own, wherever a worker is free."""

    def __init__(
        self,
        office: DesignOffice,
        design_id: str,
        attempt: int,
        plan: Plan,
        versions: Mapping[str, PluginVersion],
        step: Callable[..., dict[str, Any] | None],
    ) -> None:
        self._office, self._design_id, self._attempt = office, design_id, attempt
        self._plan, self._versions, self._step = plan, versions, step
        self._stages = load_stages(office.workshop.stages_at)

    def put(self, value: Any) -> Ref:
        """Store an input by its content."""
        return self._office.workshop.put(value)

    def get(self, ref: Ref) -> Any:
        """A stored value."""
        return self._office.workshop.get(ref)

    def map(self, stage: str, calls: Sequence[Mapping[str, Any]]) -> list[Ref]:
        """Run one stage on each of the calls; equal calls run once. The first failure stops the others."""
        steps = [step_call(self._stages[stage], inputs, self._plan, self._versions) for inputs in calls]
        distinct = {step["key"]: step for step in steps}
        # Recorded, so that a design that is run again after a crash makes the same calls, though more is stored by then.
        missing = _recorded("missing", lambda: self._missing(stage, distinct))
        children = [
            self._enqueue(distinct[key], index + len(distinct) - len(missing), len(distinct)) for index, key in enumerate(missing)
        ]
        if children:
            problem = _recorded("await", lambda: self._await(children))
            if problem is not None:
                raise _error_of(problem)
        return [step["key"] for step in steps]

    def _missing(self, stage: str, keys: Iterable[str]) -> list[str]:
        """The keys of steps whose result is not stored; the others are counted."""
        found = {key: self._office.workshop.steps.has(key) for key in keys}
        observed_hits(self._office, self._design_id, self._attempt, stage, sum(found.values()))
        return [key for key, is_stored in found.items() if not is_stored]

    def _enqueue(self, call: StepCall, index: int, total: int) -> str:
        child = f"{workflow_id(self._design_id, self._attempt)}.{call['stage']}.{call['key'][:32]}"
        with SetWorkflowID(child):
            DBOS.enqueue_workflow(CPU_QUEUE, self._step, self._design_id, self._attempt, call, [index, total])
        return child

    def _await(self, children: list[str]) -> dict[str, Any] | None:
        """Wait until all have ended; the problem of the first that failed or of the cancellation, which drops those that wait."""
        cancelled, waiting = _Cancellation(self._office, self._design_id), set(children)
        while waiting:
            time.sleep(_POLL_S)
            statuses = DBOS.list_workflows(workflow_ids=sorted(waiting), load_input=False)
            ended = [status for status in statuses if status.status not in _ACTIVE]
            waiting -= {status.workflow_id for status in ended}
            problems = [_problem_of(status) for status in ended]
            if cancelled():
                problems.insert(0, problem_of(Cancelled("the caller asked to stop")))
            problem = next(filter(None, problems), None)
            if problem is not None:
                DBOS.cancel_workflows([status.workflow_id for status in statuses if status.status == _QUEUED])
                return problem
        return None


class _Cancellation:
    """Whether somebody asked to stop a design, asked of the database four times a second at most."""

    def __init__(self, office: DesignOffice, design_id: str) -> None:
        self._office, self._design_id = office, design_id
        self._next_s = 0.0
        self._asked = False

    def __call__(self) -> bool:
        if not self._asked and time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _CANCEL_POLL_S
            self._asked = self._office.jobs.cancel_requested(self._design_id)
        return self._asked


def workflow_id(design_id: str, attempt: int) -> str:
    """The workflow of one attempt of a design."""
    return f"{design_id}.{attempt}"


def _recorded(name: str, function: Callable[[], Any]) -> Any:
    """What `function` returned the first time this place of the workflow was reached; a GripwrightError included."""

    def outcome() -> dict[str, Any]:
        try:
            return {"value": function()}
        except GripwrightError as error:
            return {"problem": problem_of(error)}

    recorded = DBOS.run_step({"name": name}, outcome)
    if "problem" in recorded:
        raise _error_of(recorded["problem"])
    return recorded["value"]


def _problem_of(status: Any) -> dict[str, Any] | None:
    """What a step's workflow ended with; DBOS itself gives one up whose worker died too often."""
    if status.status == WorkflowStatusString.SUCCESS.value:
        problem: dict[str, Any] | None = status.output
        return problem
    stage = status.workflow_id.split(".")[2]
    return problem_of(
        StepFailure(f"the step {stage!r} was given up: its worker ended {_STEP_RECOVERIES + 1} times in it", stage=stage)
    )


def _error_of(problem: Mapping[str, Any]) -> GripwrightError:
    if problem["code"] == Cancelled.code:
        return Cancelled(problem["detail"])
    faults = tuple(Fault(**fault) for fault in problem["errors"])
    return Refused(problem["code"], problem["detail"], faults, stage=problem["stage"], plugin=problem["plugin"])


def _use_wal(database_url: str) -> None:
    """DBOS leaves SQLite in its rollback journal, where readers and writers block each other; the mode stays in the file."""
    scheme, _, path = database_url.partition(":///")
    if scheme.startswith("sqlite"):
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        with sqlite3.connect(path) as connection:
            connection.execute("PRAGMA journal_mode=WAL")
        connection.close()
