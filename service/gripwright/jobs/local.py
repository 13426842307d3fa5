"""Designs in this process: steps in children, in parallel, results stored. What the command line uses."""

import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from typing import Any

from gripwright.design.plan import Plan
from gripwright.design.runner import Ref
from gripwright.jobs.engine import OnProgress
from gripwright.jobs.progress import design_fraction
from gripwright.jobs.steps import StepCall, Workshop, load_stages, resolve_plan, run_step, step_call


class LocalRunner:
    """A `Runner` that computes what is not stored in up to `workers` children at a time."""

    def __init__(
        self,
        workshop: Workshop,
        plan: Plan,
        *,
        workers: int = 2,
        on_progress: OnProgress = lambda fraction, stage, message: None,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> None:
        self.plan, self.versions = resolve_plan(workshop, plan)
        self._stages = load_stages(workshop.stages_at)
        self._workshop, self._workers = workshop, workers
        self._on_progress, self._cancelled = on_progress, cancelled

    def put(self, value: Any) -> Ref:
        """Store an input by its content."""
        return self._workshop.put(value)

    def get(self, ref: Ref) -> Any:
        """A stored value."""
        return self._workshop.get(ref)

    def map(self, stage: str, calls: Sequence[Mapping[str, Any]]) -> list[Ref]:
        """Run one stage on each of the calls; equal calls run once. The first failure stops the others."""
        steps = [step_call(self._stages[stage], inputs, self.plan, self.versions) for inputs in calls]
        distinct = {step["key"]: step for step in steps}
        done = {key: 1.0 if self._workshop.steps.has(key) else 0.0 for key in distinct}  # fraction of each step
        stop = threading.Event()

        def advance(key: str, fraction: float, message: str) -> None:
            done[key] = fraction
            self._on_progress(design_fraction(list(self._stages), stage, sum(done.values()), len(done)), stage, message)

        def compute(step: StepCall) -> None:
            run_step(
                self._workshop,
                step,
                on_progress=lambda fraction, message: advance(step["key"], fraction, message),
                cancelled=lambda: stop.is_set() or self._cancelled(),
            )
            advance(step["key"], 1.0, "")

        with ThreadPoolExecutor(max_workers=self._workers) as pool:
            futures = [pool.submit(compute, distinct[key]) for key, fraction in done.items() if fraction < 1.0]
            try:
                finished, _ = wait(futures, return_when=FIRST_EXCEPTION)
            finally:
                stop.set()  # no child outlives this call, however it ends
        for future in finished:
            future.result()
        return [step["key"] for step in steps]
