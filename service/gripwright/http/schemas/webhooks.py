"""Webhooks as callers see them."""

from datetime import datetime

from pydantic import AnyHttpUrl, BaseModel, ConfigDict, Field

from gripwright.store.events import WEBHOOK_EVENTS, EventName
from gripwright.store.models import WebhookDeliveryRow, WebhookRow


class WebhookRequest(BaseModel):
    """Where to send which events."""

    model_config = ConfigDict(extra="forbid")

    url: AnyHttpUrl
    events: list[EventName] = Field(default=list(WEBHOOK_EVENTS), min_length=1)


class DeliveryView(BaseModel):
    """One message to a webhook."""

    id: str
    status: str = Field(description="pending, delivered, failed")
    attempts: int
    detail: str
    next_attempt_at: datetime | None
    created_at: datetime

    @classmethod
    def of(cls, row: WebhookDeliveryRow) -> "DeliveryView":
        """The view of a message."""
        return cls(
            id=row.id,
            status=row.status,
            attempts=row.attempts,
            detail=row.detail,
            next_attempt_at=row.next_attempt_at if row.status == "pending" else None,
            created_at=row.created_at,
        )


class WebhookView(BaseModel):
    """A webhook with its newest messages."""

    id: str
    url: str
    events: list[str]
    deliveries: list[DeliveryView]
    created_at: datetime

    @classmethod
    def of(cls, row: WebhookRow, deliveries: list[WebhookDeliveryRow]) -> "WebhookView":
        """The view of a webhook; never its secret."""
        return cls(
            id=row.id,
            url=row.url,
            events=row.events,
            deliveries=[DeliveryView.of(delivery) for delivery in deliveries],
            created_at=row.created_at,
        )


class WebhookCreated(BaseModel):
    """A new webhook: the only answer that shows its secret."""

    id: str
    url: str
    events: list[str]
    secret: str = Field(description="key of the signatures (Standard Webhooks)")
    created_at: datetime

    @classmethod
    def of(cls, row: WebhookRow) -> "WebhookCreated":
        """The view of a new webhook."""
        return cls(id=row.id, url=row.url, events=row.events, secret=row.secret, created_at=row.created_at)
