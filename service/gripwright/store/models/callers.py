"""Callers: their keys, what they did, and the answers that they may ask for again."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    JSON,
    CheckConstraint,
    Index,
    LargeBinary,
    String,
)
from sqlalchemy.orm import Mapped, mapped_column

from gripwright.store.models.base import ID, SHA256, Base


class IdempotencyRow(Base):
    """A request under an `Idempotency-Key`: in flight while it has no status, afterwards its answer, to be given again."""

    __tablename__ = "idempotency"
    __table_args__ = (Index(None, "expires_at"),)

    caller_sha256: Mapped[str] = mapped_column(SHA256, primary_key=True)  # keys belong to their callers
    key: Mapped[str] = mapped_column(String(255), primary_key=True)
    claim_id: Mapped[str] = mapped_column(ID)  # of the request; another one may take over what has expired
    request_sha256: Mapped[str | None] = mapped_column(SHA256)  # of method, path and body
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

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    name: Mapped[str] = mapped_column(String(100))
    scope: Mapped[str] = mapped_column(String(20))
    secret_sha256: Mapped[str] = mapped_column(SHA256)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]


class AuditRow(Base):
    """An answered request, or a command that changed the keys."""

    __tablename__ = "audit"
    __table_args__ = (Index(None, "created_at", "id"),)

    id: Mapped[str] = mapped_column(ID, primary_key=True)
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
