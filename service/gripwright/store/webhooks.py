"""All SQL about webhooks and the messages to them."""

from datetime import datetime, timedelta

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from gripwright.domain.errors import NotFound
from gripwright.store.models import WebhookDeliveryRow, WebhookRow


class WebhookRepository:
    """Subscribers. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, row: WebhookRow) -> None:
        """Add a subscriber."""
        self._session.add(row)
        self._session.flush()

    def get(self, webhook_id: str) -> WebhookRow:
        """The subscriber, or `NotFound`."""
        row = self._session.get(WebhookRow, webhook_id)
        if row is None:
            raise NotFound(f"no webhook {webhook_id}", webhook_id=webhook_id)
        return row

    def delete(self, row: WebhookRow) -> None:
        """Remove a subscriber with all messages to it."""
        self._session.delete(row)
        self._session.flush()

    def count_disabled(self) -> int:
        """How many nothing is sent to."""
        return self._session.scalar(select(func.count()).where(WebhookRow.enabled.is_(False))) or 0

    def delivery_counts(self) -> dict[str, int]:
        """How many messages are kept of each status."""
        query = select(WebhookDeliveryRow.status, func.count().label("messages")).group_by(WebhookDeliveryRow.status)
        return {row.status: row.messages for row in self._session.execute(query)}

    def deliveries(self, webhook_id: str, limit: int) -> list[WebhookDeliveryRow]:
        """The newest messages to a subscriber."""
        query = select(WebhookDeliveryRow).where(WebhookDeliveryRow.webhook_id == webhook_id)
        return list(self._session.scalars(query.order_by(WebhookDeliveryRow.id.desc()).limit(limit)))


class DeliveryRepository:
    """Messages that are due."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def claim(self, now: datetime, lease: timedelta) -> tuple[WebhookDeliveryRow, WebhookRow] | None:
        """Take the message that is due longest; nobody else gets it before the lease ends."""
        query = (
            select(WebhookDeliveryRow, WebhookRow)
            .join(WebhookRow, WebhookRow.id == WebhookDeliveryRow.webhook_id)
            .where(WebhookDeliveryRow.status == "pending", WebhookDeliveryRow.next_attempt_at <= now)
            .order_by(WebhookDeliveryRow.next_attempt_at)
            .limit(1)
            .with_for_update(skip_locked=True, of=WebhookDeliveryRow)
        )
        found = self._session.execute(query).first()
        if found is None:
            return None
        delivery, webhook = found
        delivery.attempts += 1
        delivery.next_attempt_at = now + lease
        return delivery, webhook

    def settle(self, delivery_id: str, *, status: str, detail: str, next_attempt_at: datetime) -> None:
        """Record how an attempt ended; a message whose subscriber was removed meanwhile is gone."""
        row = self._session.get(WebhookDeliveryRow, delivery_id)
        if row is not None:
            row.status, row.detail, row.next_attempt_at = status, detail, next_attempt_at
