"""What became of a step whose child brought no result: whose fault it is, and whether another try is worth it."""

import logging
from collections.abc import Callable, Collection
from typing import Any

from gripwright.domain.errors import GripwrightError, PluginFailure
from gripwright.jobs.child import ChildBroke, ChildFailure, ChildLost, ChildNotStarted
from gripwright.jobs.engine import PassingFailure, StepBroke, StepFailure
from gripwright.registry.description import RegistryUnreadable, describe_in_child

log = logging.getLogger(__name__)


def guarded(stage: str, allow: Collection[str] | None, run: Callable[[], Any]) -> Any:
    """What `run` returns; a child that failed is a StepFailure of its stage, and names the plug-in that it called.

    Where no child could be started, all plug-ins that `allow` names are imported once more: a PluginFailure names the one that
    ends the process.
    """
    try:
        return run()
    except ChildNotStarted as failure:
        log.warning("step %s: %s", stage, failure)
        raise _not_started(stage, allow, failure) from failure
    except ChildFailure as failure:
        where = "" if failure.plugin is None else f", in {failure.plugin}"
        plugin = None if failure.plugin is None else failure.plugin.partition(" ")[0]
        log.warning("step %s: %s%s", stage, failure, where)
        kind = PassingFailure if isinstance(failure, ChildLost) else StepBroke if isinstance(failure, ChildBroke) else StepFailure
        raise kind(f"the step {stage!r} {failure}{where}", stage=stage, plugin=plugin) from failure


def _not_started(stage: str, allow: Collection[str] | None, failure: ChildNotStarted) -> GripwrightError:
    try:
        describe_in_child(allow=allow)
    except RegistryUnreadable as unreadable:
        told = f"the step {stage!r} {failure}: {unreadable.detail}"
        return PluginFailure(told, stage=stage, plugin=unreadable.context.get("distribution"))
    except OSError as error:  # the machine is short of what a process needs
        log.warning("step %s: the plug-ins cannot be listed: %s", stage, error)
    return PassingFailure(f"the step {stage!r} {failure}", stage=stage, plugin=None)
