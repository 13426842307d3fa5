"""The tables. Every constraint is named, so that migrations can change it; contents of files live in the artifact store."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Text,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

from gripwright.store.columns import UtcDateTime

_ID = String(32)
_SHA256 = String(64)

JOB_STATUSES = ("queued", "running", "succeeded", "failed", "cancelled")
"""Of a job; the last three are final."""

DELIVERY_STATUSES = ("pending", "delivered", "failed")
"""Of a message to a webhook."""


class Base(DeclarativeBase):
    """Base of all tables."""

    metadata = MetaData(
        naming_convention={
            "pk": "pk_%(table_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
        }
    )
    type_annotation_map = {datetime: UtcDateTime(), dict[str, Any]: JSON(), list[Any]: JSON()}  # noqa: RUF012


class ProductRow(Base):
    """A product: its manifest (product.json) and the assembly task read from its files."""

    __tablename__ = "product"
    __table_args__ = (
        UniqueConstraint("part_number", "revision"),
        Index(None, "created_at", "id"),
        Index(None, "updated_at", "id"),
    )

    id: Mapped[str] = mapped_column(_ID, primary_key=True)
    part_number: Mapped[str] = mapped_column(String(500))
    revision: Mapped[str] = mapped_column(String(500))
    name: Mapped[str] = mapped_column(Text)
    content_sha256: Mapped[str] = mapped_column(_SHA256)  # of the task as uploaded: the identity of the content
    task_sha256: Mapped[str] = mapped_column(_SHA256)  # artifact: the task as it is now, a record
    manifest: Mapped[dict[str, Any]]  # product.json as it is now
    warnings: Mapped[list[Any]]
    version: Mapped[int]  # counts changes; the ETag
    created_at: Mapped[datetime]
    updated_at: Mapped[datetime]

    components: Mapped[list["ComponentRow"]] = relationship(
        order_by="ComponentRow.position", cascade="all, delete-orphan", passive_deletes=True
    )
    external_ids: Mapped[list["ExternalIdRow"]] = relationship(cascade="all, delete-orphan", passive_deletes=True)


class ExternalIdRow(Base):
    """What another system calls a product. The manifest holds it, too; this table is to search by."""

    __tablename__ = "external_id"
    __table_args__ = (Index(None, "system", "value"),)

    product_id: Mapped[str] = mapped_column(_ID, ForeignKey("product.id", ondelete="CASCADE"), primary_key=True)
    system: Mapped[str] = mapped_column(String(64), primary_key=True)
    value: Mapped[str] = mapped_column(String(200))  # of several products, where they are revisions of one item


class ComponentRow(Base):
    """A component of a product: what was measured of its mesh. The rest is in the manifest."""

    __tablename__ = "component"
    __table_args__ = (UniqueConstraint("product_id", "position"),)

    product_id: Mapped[str] = mapped_column(_ID, ForeignKey("product.id", ondelete="CASCADE"), primary_key=True)
    id: Mapped[str] = mapped_column(String(200), primary_key=True)
    position: Mapped[int]
    glb_sha256: Mapped[str] = mapped_column(_SHA256)  # artifact: its mesh as GLB
    faces: Mapped[int]
    bounds_min_mm: Mapped[list[Any]]  # (3,) component frame
    bounds_max_mm: Mapped[list[Any]]


class DesignRow(Base):
    """A design of a product: the snapshot it was requested with, and its outcome."""

    __tablename__ = "design"
    __table_args__ = (Index(None, "product_id", "created_at"),)

    id: Mapped[str] = mapped_column(_ID, primary_key=True)
    product_id: Mapped[str] = mapped_column(_ID, ForeignKey("product.id", ondelete="CASCADE"))
    product_version: Mapped[int]
    task_sha256: Mapped[str] = mapped_column(_SHA256)  # artifact: AssemblyTask record
    actuators_sha256: Mapped[str] = mapped_column(_SHA256)  # artifact: tuple[Actuator, ...] record
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

    design_id: Mapped[str] = mapped_column(_ID, ForeignKey("design.id", ondelete="CASCADE"), primary_key=True)
    path: Mapped[str] = mapped_column(String(400), primary_key=True)  # "grippers/G1/finger.step"
    sha256: Mapped[str] = mapped_column(_SHA256)  # artifact
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

    id: Mapped[str] = mapped_column(_ID, ForeignKey("design.id", ondelete="CASCADE"), primary_key=True)  # the design's
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
    failed_step: Mapped[str | None] = mapped_column(_SHA256)  # key of the step that it failed in
    updated_at: Mapped[datetime]  # of its latest event
    traceparent: Mapped[str | None] = mapped_column(String(55))  # of the request that asked for it (W3C Trace Context)

    design: Mapped[DesignRow] = relationship(back_populates="job")


class QuarantineRow(Base):
    """A step that broke its process in a way that does not heal: it is not tried again before a caller asks for it."""

    __tablename__ = "quarantine"
    __table_args__ = (Index(None, "created_at"),)

    key: Mapped[str] = mapped_column(_SHA256, primary_key=True)  # of the step's call
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
    job_id: Mapped[str] = mapped_column(_ID, ForeignKey("job.id", ondelete="CASCADE"))
    kind: Mapped[str] = mapped_column(String(50))  # "status", "progress", "log"
    data: Mapped[dict[str, Any]]
    created_at: Mapped[datetime]


class ActuatorRow(Base):
    """An actuator of the catalogue; the columns are the fields of `domain.gripper.Actuator`."""

    __tablename__ = "actuator"

    maker: Mapped[str] = mapped_column(String(100), primary_key=True)
    model: Mapped[str] = mapped_column(String(200), primary_key=True)
    gripper_type: Mapped[str] = mapped_column(String(50))
    stroke_mm: Mapped[float]
    opening_max_mm: Mapped[float | None]
    grip_force_N: Mapped[float | None]
    mass_kg: Mapped[float | None]
    finger_length_max_mm: Mapped[float | None]
    finger_mass_max_kg: Mapped[float | None]
    body_diameter_mm: Mapped[float | None]
    body_length_mm: Mapped[float | None]
    price: Mapped[float | None]
    stroke_basis: Mapped[str] = mapped_column(String(20))
    force_basis: Mapped[str] = mapped_column(String(20))
    confidence: Mapped[str] = mapped_column(String(20))
    source: Mapped[str] = mapped_column(Text)
    note: Mapped[str] = mapped_column(Text)
    version: Mapped[int]
    updated_at: Mapped[datetime]


class WebhookRow(Base):
    """A subscriber to events."""

    __tablename__ = "webhook"
    __table_args__ = (Index(None, "created_at", "id"),)

    id: Mapped[str] = mapped_column(_ID, primary_key=True)
    url: Mapped[str] = mapped_column(Text)
    events: Mapped[list[Any]]
    secret: Mapped[str] = mapped_column(String(100))  # "whsec_" and base64
    old_secret: Mapped[str | None] = mapped_column(String(100))  # signs too, until it expires
    old_secret_expires_at: Mapped[datetime | None]
    enabled: Mapped[bool]
    disabled_reason: Mapped[str] = mapped_column(Text)  # "" while it is enabled
    failing_since: Mapped[datetime | None]  # the first attempt that failed since one succeeded
    rests_until: Mapped[datetime | None]  # nothing is sent before: an attempt is under way, or it asked for a pause
    created_at: Mapped[datetime]


class WebhookDeliveryRow(Base):
    """One message to one subscriber, until it is delivered or given up."""

    __tablename__ = "webhook_delivery"
    __table_args__ = (
        Index(None, "status", "next_attempt_at"),
        Index(None, "webhook_id", "created_at", "id"),
        CheckConstraint(f"status IN {DELIVERY_STATUSES}", name="status"),
    )

    id: Mapped[str] = mapped_column(_ID, primary_key=True)  # the message's webhook-id, the same in every attempt
    webhook_id: Mapped[str] = mapped_column(_ID, ForeignKey("webhook.id", ondelete="CASCADE"))
    payload: Mapped[str] = mapped_column(Text)  # the exact body that is signed
    status: Mapped[str] = mapped_column(String(20))
    attempts: Mapped[int]
    next_attempt_at: Mapped[datetime]
    detail: Mapped[str] = mapped_column(Text)  # of the last attempt
    created_at: Mapped[datetime]


class WebhookAttemptRow(Base):
    """One attempt to deliver a message, and what came back."""

    __tablename__ = "webhook_attempt"
    __table_args__ = (Index(None, "delivery_id", "id"),)

    id: Mapped[str] = mapped_column(_ID, primary_key=True)
    delivery_id: Mapped[str] = mapped_column(_ID, ForeignKey("webhook_delivery.id", ondelete="CASCADE"))
    started_at: Mapped[datetime]
    duration_s: Mapped[float]
    status_code: Mapped[int | None]
    error: Mapped[str] = mapped_column(Text)  # "" where it was accepted
    response: Mapped[str] = mapped_column(Text)  # its first bytes


class StepStatRow(Base):
    """How often steps of one stage ended so, and how long they took: counted by all workers, never taken back."""

    __tablename__ = "step_stat"

    stage: Mapped[str] = mapped_column(String(100), primary_key=True)
    outcome: Mapped[str] = mapped_column(String(100), primary_key=True)  # "computed", "stored", or the code of a problem
    bucket: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)  # of durations, see `store.step_stats`
    steps: Mapped[int] = mapped_column(BigInteger)
    seconds: Mapped[float]


class IdempotencyRow(Base):
    """A request under an `Idempotency-Key`: in flight while it has no status, afterwards its answer, to be given again."""

    __tablename__ = "idempotency"
    __table_args__ = (Index(None, "expires_at"),)

    caller_sha256: Mapped[str] = mapped_column(_SHA256, primary_key=True)  # keys belong to their callers
    key: Mapped[str] = mapped_column(String(255), primary_key=True)
    claim_id: Mapped[str] = mapped_column(_ID)  # of the request; another one may take over what has expired
    request_sha256: Mapped[str | None] = mapped_column(_SHA256)  # of method, path and body
    status: Mapped[int | None]
    headers: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True))  # pairs of name and value
    body: Mapped[bytes | None] = mapped_column(LargeBinary)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]


class ApiKeyRow(Base):
    """A key to the HTTP interface. Its secret is not stored."""

    __tablename__ = "api_key"
    __table_args__ = (
        Index(None, "name"),
        CheckConstraint("scope IN ('read', 'write', 'admin')", name="scope"),
    )

    id: Mapped[str] = mapped_column(_ID, primary_key=True)
    name: Mapped[str] = mapped_column(String(100))
    scope: Mapped[str] = mapped_column(String(20))
    secret_sha256: Mapped[str] = mapped_column(_SHA256)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]


class AuditRow(Base):
    """An answered request, or a command that changed the keys."""

    __tablename__ = "audit"
    __table_args__ = (Index(None, "created_at", "id"),)

    id: Mapped[str] = mapped_column(_ID, primary_key=True)
    created_at: Mapped[datetime]  # when it was answered
    actor: Mapped[str] = mapped_column(
        String(300)
    )  # "key:…", "token:…", "cli:…", "anonymous", "" where the credential was refused
    actor_name: Mapped[str] = mapped_column(String(300))
    client: Mapped[str] = mapped_column(String(64))  # address that the connection came from
    method: Mapped[str] = mapped_column(String(20))  # "CLI" for a command
    path: Mapped[str] = mapped_column(String(2000))  # without its query
    status: Mapped[int]
    resource_id: Mapped[str] = mapped_column(String(300))  # "" where there is none
    request_id: Mapped[str] = mapped_column(String(64))


class WorkerRow(Base):
    """A worker process, from its start until it ends or another one takes its work over."""

    __tablename__ = "worker"

    id: Mapped[str] = mapped_column(_ID, primary_key=True)  # the executor's id in the job engine; never used again
    host: Mapped[str] = mapped_column(String(255))
    process: Mapped[str] = mapped_column(String(200))  # as `jobs.hosts.ProcessName` spells it
    pid: Mapped[int]
    version: Mapped[str] = mapped_column(String(50))
    steps: Mapped[int]  # that it runs
    started_at: Mapped[datetime]  # by the database's clock, as the next
    heartbeat_at: Mapped[datetime]
