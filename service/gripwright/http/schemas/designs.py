"""Designs and jobs as callers see them."""

from datetime import datetime
from typing import Annotated, Any
from urllib.parse import quote

from pydantic import BaseModel, ConfigDict, Field

from gripwright.store.designs import PRIORITY, PRIORITY_MAX
from gripwright.store.models import DesignFileRow, DesignRow, JobRow

DEADLINE_MAX_S = 30 * 86_400.0

Priority = Annotated[int, Field(ge=0, le=PRIORITY_MAX, description="9 is the most urgent, 5 the usual")]


class DesignRequest(BaseModel):
    """What to design with; what is left out has its default."""

    model_config = ConfigDict(extra="forbid")

    options: dict[str, Any] = Field(
        default_factory=dict,
        description="the plan: plug-in keys and their parameters, as in `gripwright design --set`; schemas at /api/v1/plugins",
        examples=[{"margin": 0.2, "sdf.rays": 30, "actuators": "all"}],
    )
    priority: Priority = PRIORITY
    deadline_s: float | None = Field(
        default=None,
        gt=0,
        le=DEADLINE_MAX_S,
        description="seconds from now until it must be done, its waiting included; by default what the service is set to",
    )


class JobPatch(BaseModel):
    """What can be changed of a job that waits."""

    model_config = ConfigDict(extra="forbid")

    priority: Priority


class Progress(BaseModel):
    """How far a job is."""

    fraction: float = Field(description="0 to 1")
    stage: str
    message: str

    @classmethod
    def of(cls, job: JobRow) -> "Progress":
        """The progress of a job."""
        return cls(fraction=job.fraction, stage=job.stage, message=job.message)


class FileView(BaseModel):
    """A file of a design folder."""

    path: str
    href: str
    size: int
    sha256: str
    media_type: str

    @classmethod
    def of(cls, row: DesignFileRow) -> "FileView":
        """The view of a file."""
        href = f"/api/v1/designs/{row.design_id}/files/{quote(row.path)}"
        return cls(path=row.path, href=href, size=row.size, sha256=row.sha256, media_type=row.media_type)


class DesignAccepted(BaseModel):
    """A design was queued."""

    id: str
    product_id: str
    status: str
    job: str = Field(description="path of its job")

    @classmethod
    def of(cls, row: DesignRow) -> "DesignAccepted":
        """The view of a queued design."""
        return cls(id=row.id, product_id=row.product_id, status=status_of(row), job=f"/api/v1/jobs/{row.id}")


class DesignView(BaseModel):
    """A design: where it stands, and its result when it is done."""

    id: str
    product_id: str
    product_version: int
    status: str = Field(description="queued, running, complete, incomplete, failed, cancelled")
    progress: Progress
    options: dict[str, Any]
    design: dict[str, Any] | None = Field(description="design.json, when done")
    files: list[FileView]
    problem: dict[str, Any] | None = Field(description="why it failed")
    created_at: datetime
    updated_at: datetime
    finished_at: datetime | None

    @classmethod
    def of(cls, row: DesignRow, document: dict[str, Any] | None) -> "DesignView":
        """The view of a design."""
        return cls(
            id=row.id,
            product_id=row.product_id,
            product_version=row.product_version,
            status=status_of(row),
            progress=Progress.of(row.job),
            options=row.options,
            design=document,
            files=[FileView.of(file) for file in row.files],
            problem=row.job.problem,
            created_at=row.created_at,
            updated_at=row.job.updated_at,
            finished_at=row.job.finished_at,
        )


class DesignSummary(BaseModel):
    """A design in a list."""

    id: str
    href: str
    product_id: str
    product_version: int
    part_number: str
    revision: str
    status: str = Field(description="queued, running, complete, incomplete, failed, cancelled")
    progress: Progress
    options: dict[str, Any]
    created_at: datetime
    updated_at: datetime
    finished_at: datetime | None

    @classmethod
    def of(cls, row: DesignRow) -> "DesignSummary":
        """The summary of a design."""
        return cls(
            id=row.id,
            href=f"/api/v1/designs/{row.id}",
            product_id=row.product_id,
            product_version=row.product_version,
            part_number=row.product.part_number,
            revision=row.product.revision,
            status=status_of(row),
            progress=Progress.of(row.job),
            options=row.options,
            created_at=row.created_at,
            updated_at=row.job.updated_at,
            finished_at=row.job.finished_at,
        )


class DesignPage(BaseModel):
    """A page of designs, the newest first."""

    items: list[DesignSummary]
    next_cursor: str | None
    next_updated_since: datetime | None = Field(
        description="of a first page: the `updated_since` that misses nothing the next time; what changed last may come twice"
    )


class JobView(BaseModel):
    """The work of a design."""

    id: str
    design: str = Field(description="path of the design")
    product_id: str
    part_number: str
    revision: str
    status: str = Field(description="queued, running, succeeded, failed, cancelled")
    outcome: str | None = Field(description="of the design: complete, incomplete; null until then")
    progress: Progress
    attempt: int
    priority: int
    deadline_at: datetime | None
    not_before: datetime | None = Field(description="when it is tried again, while it waits for a passing failure to heal")
    cancel_requested: bool
    problem: dict[str, Any] | None
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    updated_at: datetime

    @classmethod
    def of(cls, row: JobRow) -> "JobView":
        """The view of a job."""
        return cls(
            id=row.id,
            design=f"/api/v1/designs/{row.id}",
            product_id=row.design.product_id,
            part_number=row.design.product.part_number,
            revision=row.design.product.revision,
            status=row.status,
            outcome=row.design.outcome,
            progress=Progress.of(row),
            attempt=row.attempt,
            priority=row.priority,
            deadline_at=row.deadline_at,
            not_before=row.not_before,
            cancel_requested=row.cancel_requested,
            problem=row.problem,
            created_at=row.created_at,
            started_at=row.started_at,
            finished_at=row.finished_at,
            updated_at=row.updated_at,
        )


class JobPage(BaseModel):
    """A page of jobs, the newest first."""

    items: list[JobView]
    next_cursor: str | None
    next_updated_since: datetime | None = Field(
        description="of a first page: the `updated_since` that misses nothing the next time; what changed last may come twice"
    )


def status_of(row: DesignRow) -> str:
    """Of a design: its outcome when its job has succeeded, else the job's status."""
    return row.outcome if row.job.status == "succeeded" and row.outcome is not None else row.job.status
