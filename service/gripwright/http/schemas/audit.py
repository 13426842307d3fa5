"""The audit trail as administrators see it."""

from datetime import datetime

from pydantic import BaseModel, Field

from gripwright.store.models import AuditRow


class AuditView(BaseModel):
    """One answered request, or a command that changed the keys."""

    at: datetime
    actor: str = Field(description="key:ID, token:SUBJECT, cli:USER, anonymous; empty where the credential was refused")
    actor_name: str
    client: str = Field(description="address that the connection came from")
    method: str = Field(description="of HTTP, or CLI")
    path: str
    status: int
    resource_id: str = Field(description="of what was made, changed or read; empty where there is none")
    request_id: str = Field(description="X-Request-ID of the answer")

    @classmethod
    def of(cls, row: AuditRow) -> "AuditView":
        """The view of a row."""
        return cls(
            at=row.created_at,
            actor=row.actor,
            actor_name=row.actor_name,
            client=row.client,
            method=row.method,
            path=row.path,
            status=row.status,
            resource_id=row.resource_id,
            request_id=row.request_id,
        )


class AuditPage(BaseModel):
    """A page of the audit trail, the newest first."""

    items: list[AuditView]
    next_cursor: str | None
