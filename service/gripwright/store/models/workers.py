"""Workers, and what they count."""

from datetime import datetime

from sqlalchemy import (
    BigInteger,
    String,
)
from sqlalchemy.orm import Mapped, mapped_column

from gripwright.store.models.base import ID, Base


class StepStatRow(Base):
    """How often steps of one stage ended so, and how long they took: counted by all workers, never taken back."""

    __tablename__ = "step_stat"

    stage: Mapped[str] = mapped_column(String(100), primary_key=True)
    outcome: Mapped[str] = mapped_column(String(100), primary_key=True)  # "computed", "stored", or the code of a problem
    bucket: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # of durations, see `store.step_stats`
    steps: Mapped[int] = mapped_column(BigInteger)
    seconds: Mapped[float]


class WorkerRow(Base):
    """A worker process, from its start until it ends or another one takes its work over."""

    __tablename__ = "worker"

    id: Mapped[str] = mapped_column(ID, primary_key=True)  # the executor's id in the job engine; never used again
    host: Mapped[str] = mapped_column(String(255))
    process: Mapped[str] = mapped_column(String(200))  # as `jobs.hosts.ProcessName` spells it
    pid: Mapped[int]
    version: Mapped[str] = mapped_column(String(50))
    steps: Mapped[int]  # that it runs
    started_at: Mapped[datetime]  # by the database's clock, as the next
    heartbeat_at: Mapped[datetime]
