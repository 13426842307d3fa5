"""The gripper-set optimisation alone, in a child process with a deadline."""

from typing import Any

from gripwright.design.gripper_set import minimise
from gripwright.design.plan import Plan
from gripwright.domain.errors import LimitExceeded
from gripwright.jobs.child import ChildFailure, ChildTimeout, Limits, Progress, run_in_child
from gripwright.jobs.engine import StepFailure
from gripwright.jobs.plugin_calls import PluginCalls
from gripwright.registry.discovery import load_registry


def solve_document(document: Any, *, timeout_s: float) -> dict[str, Any]:
    """The answer to a gripper-set problem as INTERFACE.md writes both. InvalidInput names every fault of the document."""
    try:
        answer: dict[str, Any] = run_in_child(_solve, document, limits=Limits(timeout_s=timeout_s), fresh=True)
    except ChildTimeout:
        raise LimitExceeded(f"the optimisation took more than {timeout_s:g} s") from None
    except ChildFailure as failure:
        where = "" if failure.plugin is None else f", in {failure.plugin}"
        plugin = None if failure.plugin is None else failure.plugin.partition(" ")[0]
        raise StepFailure(f"the optimisation {failure}{where}", stage="select", plugin=plugin) from failure
    return answer


def _solve(document: Any, progress: Progress, calls: PluginCalls) -> dict[str, Any]:
    """Runs in the child: the one plug-in that is needed, with its default parameters."""
    del progress
    key = Plan().optimizer
    optimizer = load_registry(kinds=("optimizer",)).find("optimizer", key)
    if optimizer is None:
        raise StepFailure(f"the optimizer {key!r} is not installed", stage="select")
    return minimise(document, calls.make(optimizer, optimizer.plugin.params_model()))
