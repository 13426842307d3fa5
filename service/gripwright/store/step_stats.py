"""All SQL about how steps and designs ended and how long they took, counted over all workers and restarts."""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from gripwright.store.models import StepStatRow

BOUNDS_S = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 900.0)
"""Upper bounds of the buckets of durations, closed; longer ones are in a last bucket."""

COMPUTED, STORED = "computed", "stored"
"""Outcomes of a step; any other is the code of the problem that it ended with."""

DESIGN = "design"
"""The stage under which whole designs are counted: by `complete`, `incomplete`, `cancelled`, or the code of a problem."""


class Kind(NamedTuple):
    """What is counted together."""

    stage: str
    outcome: str
    bucket: int


class Ended(NamedTuple):
    """How many, and their durations together."""

    steps: int
    seconds: float


def kind_of(stage: str, outcome: str, seconds: float) -> Kind:
    """Where a step that took so long is counted."""
    return Kind(stage, outcome, bisect_left(BOUNDS_S, seconds))


class StepStatRepository:
    """Counts that only grow. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, counted: Mapping[Kind, Ended]) -> None:
        """Add to the counts; in one order, so that two processes cannot wait for each other."""
        insert = postgresql.insert if self._session.get_bind().dialect.name == "postgresql" else sqlite.insert
        for kind, ended in sorted(counted.items()):
            row = insert(StepStatRow).values(**kind._asdict(), **ended._asdict())
            grown = {"steps": StepStatRow.steps + ended.steps, "seconds": StepStatRow.seconds + ended.seconds}
            self._session.execute(row.on_conflict_do_update(index_elements=list(Kind._fields), set_=grown))

    def all(self) -> Sequence[tuple[Kind, Ended]]:
        """All counts, by stage, outcome and bucket."""
        rows = self._session.scalars(select(StepStatRow).order_by(StepStatRow.stage, StepStatRow.outcome, StepStatRow.bucket))
        return [(Kind(row.stage, row.outcome, row.bucket), Ended(row.steps, row.seconds)) for row in rows]
