"""Webhooks and what is sent to them."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    CheckConstraint,
    ForeignKey,
    Index,
    String,
    Text,
)
from sqlalchemy.orm import Mapped, mapped_column

from gripwright.store.models.base import ID, Base

DELIVERY_STATUSES = ("pending", "delivered", "failed")
"""Of a message to a webhook."""


class WebhookRow(Base):
    """A subscriber to events."""

    __tablename__ = "webhook"
    __table_args__ = (Index(None, "created_at", "id"),)

    id: Mapped[str] = mapped_column(ID, primary_key=True)
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

    id: Mapped[str] = mapped_column(ID, primary_key=True)  # the message's webhook-id, the same in every attempt
    webhook_id: Mapped[str] = mapped_column(ID, ForeignKey("webhook.id", ondelete="CASCADE"))
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

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    delivery_id: Mapped[str] = mapped_column(ID, ForeignKey("webhook_delivery.id", ondelete="CASCADE"))
    started_at: Mapped[datetime]
    duration_s: Mapped[float]
    status_code: Mapped[int | None]
    error: Mapped[str] = mapped_column(Text)  # "" where it was accepted
    response: Mapped[str] = mapped_column(Text)  # its first bytes
