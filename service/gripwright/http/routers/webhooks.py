"""Webhooks: who is told when a design has ended, and what became of the messages."""

from datetime import timedelta
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response, status

from gripwright.domain.errors import Conflict, Fault, InvalidInput
from gripwright.http.deps import Now, ReadSession, Service, WriteSession
from gripwright.http.idempotency import ActingRoute
from gripwright.http.pagination import Page, link_next
from gripwright.http.schemas.problem import problems
from gripwright.http.schemas.webhooks import (
    DeliveryDetail,
    DeliveryPage,
    DeliveryView,
    RotationRequest,
    WebhookCreated,
    WebhookPage,
    WebhookPatch,
    WebhookRequest,
    WebhookSummary,
    WebhookView,
)
from gripwright.jobs.webhook_signing import new_secret, trial_payload
from gripwright.jobs.webhook_targets import check_target
from gripwright.store.columns import new_id
from gripwright.store.models import WebhookDeliveryRow, WebhookRow
from gripwright.store.pages import Cursor
from gripwright.store.webhooks import WebhookRepository

router = APIRouter(prefix="/webhooks", tags=["webhooks"], route_class=ActingRoute)

DeliveryStatus = Literal["pending", "delivered", "failed"]
_NEWEST = 50


@router.post(
    "",
    operation_id="create_webhook",
    status_code=status.HTTP_201_CREATED,
    responses=problems(422),
)
def create_webhook(body: WebhookRequest, session: WriteSession, service: Service, now: Now, response: Response) -> WebhookCreated:
    """Subscribe to the ends of designs. Messages are signed as Standard Webhooks says; the secret is shown this once."""
    check_target(str(body.url), allow_private=service.settings.webhook_private_targets)
    row = WebhookRow(
        id=new_id(now),
        url=str(body.url),
        events=list(body.events),
        secret=new_secret(),
        enabled=True,
        disabled_reason="",
        created_at=now,
    )
    WebhookRepository(session).add(row)
    response.headers["Location"] = f"/api/v1/webhooks/{row.id}"
    return WebhookCreated.of(row)


@router.get("", operation_id="list_webhooks", responses=problems(422))
def list_webhooks(session: ReadSession, page: Page, request: Request, response: Response) -> WebhookPage:
    """Webhooks, the oldest first."""
    rows = WebhookRepository(session).page(after=page.after, limit=page.limit + 1)
    shown, next_cursor = page.cut(rows, _cursor)
    link_next(request, response, next_cursor)
    return WebhookPage(items=[WebhookSummary.of(row) for row in shown], next_cursor=next_cursor)


@router.get("/{webhook_id}", operation_id="get_webhook", responses=problems(404))
def get_webhook(webhook_id: str, session: ReadSession) -> WebhookView:
    """A webhook with its newest messages."""
    webhooks = WebhookRepository(session)
    return WebhookView.with_deliveries(webhooks.get(webhook_id), webhooks.deliveries(webhook_id, limit=_NEWEST))


@router.patch("/{webhook_id}", operation_id="change_webhook", responses=problems(404, 422))
def change_webhook(webhook_id: str, body: WebhookPatch, session: WriteSession, service: Service) -> WebhookSummary:
    """Change where messages go, which, or whether. To enable a webhook again forgets why it was disabled."""
    given = body.model_dump(exclude_unset=True)
    if nulls := [name for name, value in given.items() if value is None]:
        faults = tuple(Fault(pointer=f"/{name}", message="cannot be null: leave it out to keep it") for name in nulls)
        raise InvalidInput("the webhook cannot be changed so", faults=faults)
    row = WebhookRepository(session).get(webhook_id)
    if body.url is not None:
        check_target(str(body.url), allow_private=service.settings.webhook_private_targets)
        row.url = str(body.url)
    row.events = given.get("events", row.events)
    if body.enabled is not None:
        row.enabled, row.disabled_reason = body.enabled, ""
        row.failing_since = row.rests_until = None
    return WebhookSummary.of(row)


@router.post("/{webhook_id}/rotate-secret", operation_id="rotate_webhook_secret", responses=problems(404, 422))
def rotate_webhook_secret(
    webhook_id: str, session: WriteSession, now: Now, body: RotationRequest | None = None
) -> WebhookCreated:
    """Give a webhook a new secret, shown this once. Messages are signed with the old one, too, until the overlap has passed."""
    row = WebhookRepository(session).get(webhook_id)
    overlap = timedelta(seconds=(body or RotationRequest()).overlap_s)
    row.old_secret, row.old_secret_expires_at, row.secret = row.secret, now + overlap, new_secret()
    return WebhookCreated.of(row)


@router.delete(
    "/{webhook_id}",
    operation_id="delete_webhook",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=problems(404),
)
def delete_webhook(webhook_id: str, session: WriteSession) -> None:
    """Unsubscribe; messages that wait are dropped."""
    webhooks = WebhookRepository(session)
    webhooks.delete(webhooks.get(webhook_id))


@router.post(
    "/{webhook_id}/test",
    operation_id="test_webhook",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(404, 409),
)
def send_test_message(webhook_id: str, session: WriteSession, now: Now, response: Response) -> DeliveryView:
    """Send a message of the type `webhook.test`. `Location` tells what becomes of it."""
    webhooks = WebhookRepository(session)
    row = webhooks.get(webhook_id)
    _require_enabled(row)
    delivery = webhooks.queue(row, trial_payload(row.id, now), now)
    response.headers["Location"] = f"/api/v1/webhooks/{row.id}/deliveries/{delivery.id}"
    return DeliveryView.of(delivery)


@router.get("/{webhook_id}/deliveries", operation_id="list_webhook_deliveries", responses=problems(404, 422))
def list_deliveries(
    webhook_id: str,
    session: ReadSession,
    page: Page,
    request: Request,
    response: Response,
    status: Annotated[DeliveryStatus | None, Query()] = None,
) -> DeliveryPage:
    """Messages to a webhook, the newest first."""
    webhooks = WebhookRepository(session)
    rows = webhooks.deliveries(webhooks.get(webhook_id).id, after=page.after, limit=page.limit + 1, status=status)
    shown, next_cursor = page.cut(rows, _cursor)
    link_next(request, response, next_cursor)
    return DeliveryPage(items=[DeliveryView.of(row) for row in shown], next_cursor=next_cursor)


@router.get("/{webhook_id}/deliveries/{delivery_id}", operation_id="get_webhook_delivery", responses=problems(404))
def get_delivery(webhook_id: str, delivery_id: str, session: ReadSession) -> DeliveryDetail:
    """A message with every attempt to deliver it, the first one first."""
    webhooks = WebhookRepository(session)
    return DeliveryDetail.with_log(webhooks.delivery(webhook_id, delivery_id), webhooks.attempts(delivery_id))


@router.post(
    "/{webhook_id}/deliveries/{delivery_id}/redeliver",
    operation_id="redeliver_webhook_delivery",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(404, 409),
)
def redeliver(webhook_id: str, delivery_id: str, session: WriteSession, now: Now) -> DeliveryView:
    """Send a message again, now and with all attempts, whatever became of it; its `webhook-id` stays the same."""
    webhooks = WebhookRepository(session)
    _require_enabled(webhooks.get(webhook_id))
    delivery = webhooks.delivery(webhook_id, delivery_id)
    delivery.status, delivery.attempts, delivery.next_attempt_at = "pending", 0, now
    return DeliveryView.of(delivery)


def _require_enabled(row: WebhookRow) -> None:
    if not row.enabled:
        raise Conflict("the webhook is disabled: enable it first", webhook_id=row.id)


def _cursor(row: WebhookRow | WebhookDeliveryRow) -> Cursor:
    return Cursor(created_at=row.created_at, id=row.id)
