"""Webhooks as callers see them."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import AnyHttpUrl, BaseModel, ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema

from gripwright.store.events import WEBHOOK_EVENTS, EventName
from gripwright.store.models import WebhookAttemptRow, WebhookDeliveryRow, WebhookRow


class WebhookRequest(BaseModel):
    """Where to send which events."""

    model_config = ConfigDict(extra="forbid")

    url: AnyHttpUrl
    events: list[EventName] = Field(default=list(WEBHOOK_EVENTS), min_length=1)


def _without_default(schema: dict[str, Any]) -> None:
    schema.pop("default")  # null stands for what is left out, and is refused where it is sent


class WebhookPatch(BaseModel):
    """What to change; what is left out stays."""

    model_config = ConfigDict(extra="forbid")

    url: AnyHttpUrl | SkipJsonSchema[None] = Field(default=None, json_schema_extra=_without_default)
    events: Annotated[list[EventName], Field(min_length=1)] | SkipJsonSchema[None] = Field(
        default=None, json_schema_extra=_without_default
    )
    enabled: bool | SkipJsonSchema[None] = Field(
        default=None, description="true starts anew after a webhook was disabled", json_schema_extra=_without_default
    )


class RotationRequest(BaseModel):
    """How to change the secret."""

    model_config = ConfigDict(extra="forbid")

    overlap_s: int = Field(default=86_400, ge=0, le=30 * 86_400, description="how long the old secret signs, too")


class DeliveryView(BaseModel):
    """One message to a webhook."""

    id: str = Field(description="the webhook-id of the message, the same in every attempt")
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


class AttemptView(BaseModel):
    """One attempt to deliver a message."""

    started_at: datetime
    duration_s: float
    status_code: int | None = Field(description="of the answer; null where there was none")
    error: str = Field(description="why it was not accepted, else empty")
    response: str = Field(description="the first KiB of the answer")


class DeliveryDetail(DeliveryView):
    """One message with what was sent and what came back."""

    payload: str = Field(description="the body, as signed")
    log: list[AttemptView]

    @classmethod
    def with_log(cls, row: WebhookDeliveryRow, attempts: list[WebhookAttemptRow]) -> "DeliveryDetail":
        """The view of a message with its attempts."""
        names = AttemptView.model_fields
        log = [AttemptView(**{name: getattr(attempt, name) for name in names}) for attempt in attempts]
        return cls(**DeliveryView.of(row).model_dump(), payload=row.payload, log=log)


class DeliveryPage(BaseModel):
    """A page of messages, the newest first."""

    items: list[DeliveryView]
    next_cursor: str | None


class WebhookSummary(BaseModel):
    """A webhook; never its secret."""

    id: str
    url: str
    events: list[str]
    enabled: bool
    disabled_reason: str = Field(description="why nothing is sent, where the service decided so")
    failing_since: datetime | None = Field(description="the first failure since something was accepted")
    old_secret_expires_at: datetime | None = Field(description="until then the old secret signs, too")
    created_at: datetime

    @classmethod
    def of(cls, row: WebhookRow) -> "WebhookSummary":
        """The view of a webhook."""
        return cls(**{name: getattr(row, name) for name in WebhookSummary.model_fields})


class WebhookView(WebhookSummary):
    """A webhook with its newest messages."""

    deliveries: list[DeliveryView]

    @classmethod
    def with_deliveries(cls, row: WebhookRow, deliveries: list[WebhookDeliveryRow]) -> "WebhookView":
        """The view of a webhook and what was sent to it."""
        views = [DeliveryView.of(delivery) for delivery in deliveries]
        return cls(**WebhookSummary.of(row).model_dump(), deliveries=views)


class WebhookPage(BaseModel):
    """A page of webhooks, the oldest first."""

    items: list[WebhookSummary]
    next_cursor: str | None


class WebhookCreated(BaseModel):
    """A webhook with a new secret: the only answer that shows it."""

    id: str
    url: str
    events: list[str]
    secret: str = Field(description="key of the signatures (Standard Webhooks)")
    created_at: datetime

    @classmethod
    def of(cls, row: WebhookRow) -> "WebhookCreated":
        """The view of a webhook with its secret."""
        return cls(id=row.id, url=row.url, events=row.events, secret=row.secret, created_at=row.created_at)
