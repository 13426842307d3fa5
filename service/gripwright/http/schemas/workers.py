"""Workers as callers see them."""

from datetime import datetime
from typing import Literal

from pydantic import BaseModel, Field

from gripwright.store.workers import WorkerStanding


class WorkerView(BaseModel):
    """A worker process that has neither ended nor been taken over."""

    id: str
    host: str
    pid: int = Field(description="on its host, in its container")
    version: str
    state: Literal["live", "stale"] = Field(description="stale: nothing was heard of it for so long that its work is taken over")
    steps: int = Field(description="that it runs")
    started_at: datetime
    heartbeat_at: datetime = Field(description="when it was last heard of, by the database's clock")

    @classmethod
    def of(cls, worker: WorkerStanding, lease_s: float) -> "WorkerView":
        """The view of a worker."""
        row = worker.row
        return cls(
            id=row.id,
            host=row.host,
            pid=row.pid,
            version=row.version,
            state="live" if worker.silent_s <= lease_s else "stale",
            steps=row.steps,
            started_at=row.started_at,
            heartbeat_at=row.heartbeat_at,
        )


class WorkerList(BaseModel):
    """All workers, the oldest first."""

    items: list[WorkerView]
