"""Webhooks: who is told when a design has ended."""

from fastapi import APIRouter, Response, status

from gripwright.http.deps import Now, ReadSession, Service, WriteSession
from gripwright.http.schemas.problem import problems
from gripwright.http.schemas.webhooks import WebhookCreated, WebhookRequest, WebhookView
from gripwright.jobs.deliveries import check_target, new_secret
from gripwright.store.columns import new_id
from gripwright.store.models import WebhookRow
from gripwright.store.webhooks import WebhookRepository

router = APIRouter(prefix="/webhooks", tags=["webhooks"])

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


@router.get("/{webhook_id}", operation_id="get_webhook", responses=problems(404))
def get_webhook(webhook_id: str, session: ReadSession) -> WebhookView:
    """A webhook with its newest messages."""
    webhooks = WebhookRepository(session)
    return WebhookView.of(webhooks.get(webhook_id), webhooks.deliveries(webhook_id, _NEWEST))


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
