"""A runner for tests of whole designs: every stage in this process."""

from collections.abc import Mapping, Sequence
from typing import Any

from gripwright.design.memory import Memory
from gripwright.design.plan import Plan
from gripwright.design.stage_table import STAGES
from gripwright.design.toolbox import Toolbox
from gripwright.plugin_api import RunContext


class HereRunner:
    """Runs every stage in this process and keeps the values by number."""

    def __init__(self, plan: Plan, toolbox: Toolbox) -> None:
        self._plan, self._toolbox = plan, toolbox
        self._values: list[Any] = []
        self.ran: list[str] = []

    def put(self, value: Any) -> str:
        self._values.append(value)
        return str(len(self._values) - 1)

    def get(self, ref: str) -> Any:
        return self._values[int(ref)]

    def map(self, stage: str, calls: Sequence[Mapping[str, Any]]) -> list[str]:
        self.ran += [stage] * len(calls)
        one = STAGES[stage]
        memory = {"memory": Memory()} if one.remembers else {}
        return [self.put(one.function({**self._of(call), **memory}, self._plan, self._toolbox, RunContext())) for call in calls]

    def _of(self, node: Any) -> Any:
        if isinstance(node, Mapping):
            return self.get(node["ref"]) if set(node) == {"ref"} else {name: self._of(item) for name, item in node.items()}
        return [self._of(item) for item in node] if isinstance(node, list | tuple) else node
