"""The job engine on DBOS Transact; the only file that knows it, but for `dbos_database`.

A design is a workflow of the worker that took it; each of its steps is a workflow of the queue `cpu`, wherever a worker is free.
What DBOS records is small JSON: results of steps are in the step store. A workflow that a killed process left behind is run again
by its successor: calls that DBOS recorded are not made again, steps that are stored are not computed again.
"""

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from dbos import DBOS, DBOSConfig, SetEnqueueOptions, SetWorkflowID, WorkflowSerializationFormat, WorkflowStatusString

import gripwright
from gripwright.design.plan import Plan
from gripwright.design.runner import Ref
from gripwright.design.toolbox import PluginVersion
from gripwright.domain.errors import Cancelled, GripwrightError
from gripwright.jobs.dbos_database import engine_options, prepare_database
from gripwright.jobs.engine import JobState, PassingFailure, Quarantined, StepBroke, StepFailure
from gripwright.jobs.observed_step import observed_design, observed_hits, run_observed_step
from gripwright.jobs.outcomes import Told, error_of, outcome, told, value_of
from gripwright.jobs.progress import Throttle, design_fraction
from gripwright.jobs.steps import StepCall, load_stages, step_call
from gripwright.jobs.stopping import StopSign
from gripwright.jobs.workflow import DesignOffice, persistently, run_design
from gripwright.store.designs import PRIORITY_MAX
from gripwright.store.engines import PASSING_ERRORS

log = logging.getLogger(__name__)

CPU_QUEUE = "cpu"
_POLL_S = 0.1
_IDLE_POLL_S = 0.75
_UNUSED_S = 60.0  # between looks at what this service has none of: notifications, schedules
_FLUSH_S = 0.5  # between looks for notifications to send; DBOS waits for the end of such a sleep when it ends
_STEP_RECOVERIES = 3  # a step that takes its whole worker down so often is given up
_QUEUED, _BEGUN = WorkflowStatusString.ENQUEUED.value, WorkflowStatusString.PENDING.value
_ACTIVE = (_QUEUED, _BEGUN, WorkflowStatusString.DELAYED.value)


class DbosEngine:
    """One process of the job engine. `executor` is its own and no other's, before or after."""

    def __init__(self, office: DesignOffice, *, database_url: str, executor: str, steps_at_a_time: int = 1) -> None:
        self._office, self._steps_at_a_time = office, steps_at_a_time
        self._database_url, self._executor = database_url, executor
        self._is_ending = False
        config = DBOSConfig(
            name="gripwright",
            system_database_url=database_url,
            application_version=gripwright.__version__,
            executor_id=executor,
            log_level="WARNING",
            db_engine_kwargs=engine_options(database_url),
            notification_listener_polling_interval_sec=_UNUSED_S,
            notification_coalesce_sec=_FLUSH_S,
            scheduler_polling_interval_sec=_UNUSED_S,
        )
        DBOS(config=config)
        self._run_design, self._run_step = self._workflows()

    def start(self) -> None:
        """Begin to work."""
        prepare_database(self._database_url)
        DBOS.launch()
        DBOS.register_queue(CPU_QUEUE, worker_concurrency=self._steps_at_a_time, polling_interval_sec=_POLL_S)

    def submit(self, design_id: str, attempt: int) -> None:
        """Run one attempt of a design in this process; to submit it again, anywhere, changes nothing."""
        with SetWorkflowID(workflow_id(design_id, attempt)):
            DBOS.start_workflow(self._run_design, design_id, attempt)

    def state(self, design_id: str, attempt: int) -> JobState:
        """Whether the engine still works on it."""
        status = DBOS.get_workflow_status(workflow_id(design_id, attempt))
        if status is None:
            return "unknown"
        alive = status.status in _ACTIVE and status.app_version == gripwright.__version__
        return "active" if alive else "ended"

    def at_work(self) -> Mapping[str, int]:
        """Every executor that has begun something and not ended it, alive or dead, and how many steps it runs."""
        steps: Counter[str] = Counter()
        begun = DBOS.list_workflows(status=_BEGUN, app_version=gripwright.__version__, load_input=False, load_output=False)
        for status in begun:
            steps[status.executor_id or ""] += status.name == "step"
        return steps

    def take_over(self, executor: str) -> None:
        """Continue what a dead executor left behind; where several workers do it, each piece is continued by one of them."""
        DBOS._recover_pending_workflows([executor])  # DBOS has no public way without its cloud

    def pace(self, *, busy: bool) -> None:
        """Look for steps often while there are designs, and seldom while there are none: an idle worker costs nothing else."""
        queue, interval_s = DBOS.retrieve_queue(CPU_QUEUE), _POLL_S if busy else _IDLE_POLL_S
        if queue is not None and queue.polling_interval_sec != interval_s:
            queue.set_polling_interval_sec(interval_s)

    def stop(self) -> None:
        """Take no more work; what runs is left to whoever starts next."""
        self._is_ending = True
        DBOS.destroy(workflow_completion_timeout_sec=0)

    def _workflows(self) -> tuple[Callable[[str, int], None], Callable[..., Told | None]]:
        @DBOS.workflow(
            name="step", max_recovery_attempts=_STEP_RECOVERIES, serialization_type=WorkflowSerializationFormat.PORTABLE
        )
        def step(design_id: str, attempt: int, call: StepCall, place: list[int]) -> Told | None:
            begun_s = time.monotonic()
            problem = self._compute(design_id, attempt, call, place)
            seconds, ending = round(time.monotonic() - begun_s, 3), "done" if problem is None else problem["detail"]
            _unless_away(lambda: self._office.jobs.record_step(design_id, attempt, call["stage"], seconds, ending))
            return problem

        @DBOS.workflow(name="design", serialization_type=WorkflowSerializationFormat.PORTABLE)
        def design(design_id: str, attempt: int) -> None:
            stop = StopSign(self._office.jobs, design_id, attempt)
            with observed_design(self._office, design_id, attempt):
                run_design(
                    self._office,
                    design_id,
                    attempt,
                    worker=self._executor,
                    resolve=lambda: _recorded("resolve", lambda: self._resolve(design_id, stop)),
                    runner=lambda plan, versions: _DurableRunner(self._office, design_id, attempt, plan, versions, step),
                    before_end=self._stay_if_ending,
                )

        return design, step

    def _stay_if_ending(self) -> None:
        """Do not return while this process ends: without its engine a design fails in ways that say nothing of the design."""
        if self._is_ending:
            threading.Event().wait()

    def _resolve(self, design_id: str, stop: StopSign) -> dict[str, Any]:
        try:
            return self._office.resolve(design_id, stop)
        except Cancelled:
            raise stop.error() from None

    def _compute(self, design_id: str, attempt: int, call: StepCall, place: list[int]) -> Told | None:
        """Run a step; None, or the problem it ended with."""
        jobs, (index, total) = self._office.jobs, place
        stages = list(load_stages(self._office.workshop.stages_at))
        report = Throttle(lambda fraction, stage, message: jobs.record_progress(design_id, attempt, fraction, stage, message))
        stop = StopSign(jobs, design_id, attempt)

        def asked_to_stop() -> bool:
            _unless_away(report.flush)
            return stop()

        def advance(fraction: float, message: str) -> None:
            fraction = design_fraction(stages, call["stage"], index + fraction, total)
            _unless_away(lambda: report(fraction, call["stage"], message))

        advance(0.0, "")
        try:
            stop.check()
            self._refuse_quarantined(call)
            run_observed_step(self._office, design_id, attempt, call, on_progress=advance, cancelled=asked_to_stop)
        except Cancelled:
            return told(stop.error())
        except StepBroke as error:
            detail, plugin = error.detail, _text(error.context.get("plugin"))
            persistently(lambda: jobs.quarantine(call["key"], stage=call["stage"], plugin=plugin, detail=detail))
            return {**told(error), "step": call["key"]}
        except GripwrightError as error:
            return {**told(error), "step": call["key"]}
        except PASSING_ERRORS as error:
            log.warning("the step %s: %s", call["stage"], error)
            detail = f"the database or the disk failed in the step {call['stage']!r}: {type(error).__name__}"
            return told(PassingFailure(detail, stage=call["stage"]))
        return None

    def _refuse_quarantined(self, call: StepCall) -> None:
        """Quarantined where the step broke before and nobody has asked for it again; its result may be stored all the same."""
        known = persistently(lambda: self._office.jobs.quarantined(call["key"]))
        if known is None or self._office.workshop.steps.has(call["key"]):
            return
        often = "once" if known.times == 1 else f"{known.times} times"
        raise Quarantined(
            f"{known.detail}, {often} by now, and is not tried again: retry the job to try it",
            stage=call["stage"],
            plugin=known.plugin,
        )


class _DurableRunner:
    """A `Runner` inside the workflow of a design: what is not stored becomes a workflow of its own, wherever a worker is free."""

    def __init__(
        self,
        office: DesignOffice,
        design_id: str,
        attempt: int,
        plan: Plan,
        versions: Mapping[str, PluginVersion],
        step: Callable[..., Told | None],
    ) -> None:
        self._office, self._design_id, self._attempt = office, design_id, attempt
        self._plan, self._versions, self._step = plan, versions, step
        self._stages = load_stages(office.workshop.stages_at)
        self._rank = 1 + PRIORITY_MAX - office.jobs.snapshot(design_id).priority  # 1 is first

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
        children = {
            self._enqueue(distinct[key], index + len(distinct) - len(missing), len(distinct)): distinct[key]
            for index, key in enumerate(missing)
        }
        if children:
            problem = _recorded("await", lambda: self._await(children))
            if problem is not None:
                raise error_of(problem)
        return [step["key"] for step in steps]

    def _missing(self, stage: str, keys: Iterable[str]) -> list[str]:
        """The keys of steps whose result is not stored; the others are counted."""
        found = {key: self._office.workshop.steps.has(key) for key in keys}
        observed_hits(self._office, self._design_id, self._attempt, stage, sum(found.values()))
        return [key for key, is_stored in found.items() if not is_stored]

    def _enqueue(self, call: StepCall, index: int, total: int) -> str:
        child = f"{workflow_id(self._design_id, self._attempt)}.{call['stage']}.{call['key'][:32]}"
        with SetWorkflowID(child), SetEnqueueOptions(priority=self._rank):
            DBOS.enqueue_workflow(CPU_QUEUE, self._step, self._design_id, self._attempt, call, [index, total])
        return child

    def _await(self, children: Mapping[str, StepCall]) -> Told | None:
        """Wait until all have ended; the problem of the first that failed, or why to stop, which drops those that wait."""
        stop, waiting = StopSign(self._office.jobs, self._design_id, self._attempt), set(children)
        while waiting:
            time.sleep(_POLL_S)
            statuses = DBOS.list_workflows(workflow_ids=sorted(waiting), load_input=False)
            ended = [status for status in statuses if status.status not in _ACTIVE]
            waiting -= {status.workflow_id for status in ended}
            problems = [self._problem_of(status, children[status.workflow_id]) for status in ended]
            if stop():
                problems.insert(0, told(stop.error()))
            problem = next(filter(None, problems), None)
            if problem is not None:
                DBOS.cancel_workflows([status.workflow_id for status in statuses if status.status == _QUEUED])
                return problem
        return None

    def _problem_of(self, status: Any, call: StepCall) -> Told | None:
        """What a step's workflow ended with; DBOS itself gives one up whose worker died too often."""
        if status.status == WorkflowStatusString.SUCCESS.value:
            problem: Told | None = status.output
            return problem
        stage, key = call["stage"], call["key"]
        if status.status != WorkflowStatusString.MAX_RECOVERY_ATTEMPTS_EXCEEDED.value:
            return told(PassingFailure(f"the step {stage!r} ended as {status.status}", stage=stage, step=key))
        detail = f"the step {stage!r} was given up: its worker ended {_STEP_RECOVERIES + 1} times in it"
        persistently(lambda: self._office.jobs.quarantine(key, stage=stage, plugin=None, detail=detail))
        return told(StepFailure(detail, stage=stage, step=key))


def workflow_id(design_id: str, attempt: int) -> str:
    """The workflow of one attempt of a design."""
    return f"{design_id}.{attempt}"


def _recorded(name: str, function: Callable[[], Any]) -> Any:
    """What `function` returned the first time this place of the workflow was reached; a GripwrightError included."""
    return value_of(DBOS.run_step({"name": name}, lambda: outcome(function)))


def _unless_away(record: Callable[[], None]) -> None:
    """Record progress where the database takes it: a step must not end because it does not."""
    try:
        record()
    except PASSING_ERRORS as error:
        log.warning("progress is not recorded: %s", error)


def _text(value: object) -> str | None:
    return None if value is None else str(value)
