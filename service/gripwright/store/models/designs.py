"""Designs, their files, and the jobs that make them."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    ForeignKey,
    Index,
    Integer,
    String,
    Text,
)
from sqlalchemy.orm import Mapped, mapped_column, relationship

from gripwright.store.models.base import ID, SHA256, Base
from gripwright.store.models.products import ProductRow

JOB_STATUSES = ("queued", "running", "succeeded", "failed", "cancelled")
"""Of a job; the last three are final."""


class DesignRow(Base):
    """A design of a product: the snapshot it was requested with, and its outcome."""

    __tablename__ = "design"
    __table_args__ = (Index(None, "product_id", "created_at"),)

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    product_id: Mapped[str] = mapped_column(ID, ForeignKey("product.id", ondelete="CASCADE"))
    product_version: Mapped[int]
    task_sha256: Mapped[str] = mapped_column(SHA256)  # artifact: AssemblyTask record
    actuators_sha256: Mapped[str] = mapped_column(SHA256)  # artifact: tuple[Actuator, ...] record
    options: Mapped[dict[str, Any]]  # as given
    outcome: Mapped[str | None] = mapped_column(String(20))  # "complete", "incomplete"; null until then
    created_at: Mapped[datetime]

    files: Mapped[list["DesignFileRow"]] = relationship(
        order_by="DesignFileRow.path", cascade="all, delete-orphan", passive_deletes=True
    )
    job: Mapped["JobRow"] = relationship(
        back_populates="design", cascade="all, delete-orphan", passive_deletes=True, lazy="joined"
    )
    product: Mapped[ProductRow] = relationship(lazy="joined")


class DesignFileRow(Base):
    """A file of a design folder."""

    __tablename__ = "design_file"

    design_id: Mapped[str] = mapped_column(ID, ForeignKey("design.id", ondelete="CASCADE"), primary_key=True)
    path: Mapped[str] = mapped_column(String(400), primary_key=True)  # "grippers/G1/finger.step"
    sha256: Mapped[str] = mapped_column(SHA256)  # artifact
    size: Mapped[int] = mapped_column(BigInteger)
    media_type: Mapped[str] = mapped_column(String(100))


class JobRow(Base):
    """The work of one design, and its entry in the queue: where it stands, and the problem that ended it."""

    __tablename__ = "job"
    __table_args__ = (
        Index(None, "created_at", "id"),
        Index(None, "status", "dispatched", "priority", "created_at"),
        Index(None, "updated_at", "id"),
        CheckConstraint(f"status IN {JOB_STATUSES}", name="status"),
    )

    id: Mapped[str] = mapped_column(ID, ForeignKey("design.id", ondelete="CASCADE"), primary_key=True)  # the design's
    status: Mapped[str] = mapped_column(String(20))
    fraction: Mapped[float]
    stage: Mapped[str] = mapped_column(String(100))
    message: Mapped[str] = mapped_column(Text)
    attempt: Mapped[int]  # counts from 1; a retry adds one
    dispatched: Mapped[bool]  # a worker has handed this attempt to the job engine
    cancel_requested: Mapped[bool]
    problem: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    created_at: Mapped[datetime]
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    priority: Mapped[int]  # 0 to 9, the most urgent
    client: Mapped[str] = mapped_column(String(300))  # who asked, as in the audit trail; "" before there were limits
    deadline_s: Mapped[float | None]  # from the request, or from a retry, to the end
    deadline_at: Mapped[datetime | None]
    not_before: Mapped[datetime | None]  # while it waits to be tried again
    recoveries: Mapped[int]  # how often it was queued again by itself since a caller asked for it
    worker: Mapped[str] = mapped_column(String(300))  # executor that took it last; "" before
    failed_step: Mapped[str | None] = mapped_column(SHA256)  # key of the step that it failed in
    updated_at: Mapped[datetime]  # of its latest event
    traceparent: Mapped[str | None] = mapped_column(String(55))  # of the request that asked for it (W3C Trace Context)

    design: Mapped[DesignRow] = relationship(back_populates="job")


class QuarantineRow(Base):
    """A step that broke its process in a way that does not heal: it is not tried again before a caller asks for it."""

    __tablename__ = "quarantine"
    __table_args__ = (Index(None, "created_at"),)

    key: Mapped[str] = mapped_column(SHA256, primary_key=True)  # of the step's call
    stage: Mapped[str] = mapped_column(String(100))
    plugin: Mapped[str | None] = mapped_column(String(300))
    times: Mapped[int]
    detail: Mapped[str] = mapped_column(Text)  # of the last time
    created_at: Mapped[datetime]  # the last time


class JobEventRow(Base):
    """Something that happened to a job, in the order of `id`, for Server-Sent Events."""

    __tablename__ = "job_event"
    __table_args__ = (Index(None, "job_id", "id"), {"sqlite_autoincrement": True})

    id: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True, autoincrement=True)
    job_id: Mapped[str] = mapped_column(ID, ForeignKey("job.id", ondelete="CASCADE"))
    kind: Mapped[str] = mapped_column(String(50))  # "status", "progress", "log"
    data: Mapped[dict[str, Any]]
    created_at: Mapped[datetime]
