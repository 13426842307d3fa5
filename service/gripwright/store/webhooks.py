"""All SQL about webhooks and the messages to them."""

from datetime import datetime, timedelta

from sqlalchemy import BindParameter, ColumnElement, Connection, CursorResult, and_, bindparam, delete, func, or_, select, tuple_
from sqlalchemy.orm import Session

from gripwright.domain.errors import NotFound
from gripwright.store.columns import UtcDateTime, new_id
from gripwright.store.models import WebhookAttemptRow, WebhookDeliveryRow, WebhookRow
from gripwright.store.pages import Cursor


class WebhookRepository:
    """Subscribers and what is sent to them. It never commits; the unit of work does."""

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

    def page(self, *, after: Cursor | None, limit: int) -> list[WebhookRow]:
        """Up to `limit` subscribers in order of (created_at, id), strictly after the cursor."""
        query = select(WebhookRow).order_by(WebhookRow.created_at, WebhookRow.id).limit(limit)
        if after is not None:
            query = query.where(tuple_(WebhookRow.created_at, WebhookRow.id) > (after.created_at, after.id))
        return list(self._session.scalars(query))

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

    def deliveries(
        self, webhook_id: str, *, after: Cursor | None = None, limit: int, status: str | None = None
    ) -> list[WebhookDeliveryRow]:
        """Up to `limit` messages to a subscriber, the newest first, strictly after the cursor."""
        row = WebhookDeliveryRow
        query = select(row).where(row.webhook_id == webhook_id).order_by(row.created_at.desc(), row.id.desc()).limit(limit)
        if status is not None:
            query = query.where(row.status == status)
        if after is not None:
            query = query.where(tuple_(row.created_at, row.id) < (after.created_at, after.id))
        return list(self._session.scalars(query))

    def delivery(self, webhook_id: str, delivery_id: str) -> WebhookDeliveryRow:
        """A message to a subscriber, or `NotFound`."""
        row = self._session.get(WebhookDeliveryRow, delivery_id)
        if row is None or row.webhook_id != webhook_id:
            raise NotFound(f"webhook {webhook_id} has no delivery {delivery_id}", delivery_id=delivery_id)
        return row

    def attempts(self, delivery_id: str) -> list[WebhookAttemptRow]:
        """The attempts to deliver a message, the first one first."""
        query = select(WebhookAttemptRow).where(WebhookAttemptRow.delivery_id == delivery_id)
        return list(self._session.scalars(query.order_by(WebhookAttemptRow.id)))

    def queue(self, webhook: WebhookRow, payload: str, now: datetime) -> WebhookDeliveryRow:
        """Queue a message to one subscriber."""
        row = WebhookDeliveryRow(
            id=new_id(now),
            webhook_id=webhook.id,
            payload=payload,
            status="pending",
            attempts=0,
            next_attempt_at=now,
            detail="",
            created_at=now,
        )
        self._session.add(row)
        return row


class DeliveryRepository:
    """Messages that are due."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def claim(self, now: datetime, lease: timedelta) -> tuple[WebhookDeliveryRow, WebhookRow] | None:
        """Take the message that is due longest; nobody sends to the same subscriber before the lease ends, or it is settled."""
        query = (
            select(WebhookDeliveryRow, WebhookRow)
            .join(WebhookRow, WebhookRow.id == WebhookDeliveryRow.webhook_id)
            .where(_due(now))
            .order_by(WebhookDeliveryRow.next_attempt_at, WebhookDeliveryRow.id)
            .limit(1)
            .with_for_update(skip_locked=True, of=(WebhookDeliveryRow, WebhookRow))
        )
        found = self._session.execute(query).first()
        if found is None:
            return None
        delivery, webhook = found
        delivery.attempts += 1
        webhook.rests_until = now + lease
        return delivery, webhook

    def find(self, delivery_id: str) -> tuple[WebhookDeliveryRow, WebhookRow] | None:
        """A message and its subscriber, locked; None where they were removed meanwhile."""
        query = select(WebhookDeliveryRow, WebhookRow).join(WebhookRow, WebhookRow.id == WebhookDeliveryRow.webhook_id)
        query = query.where(WebhookDeliveryRow.id == delivery_id).with_for_update()
        found = self._session.execute(query).first()
        return None if found is None else (found[0], found[1])

    def remove_before(self, moment: datetime) -> int:
        """Remove messages that are older, with their attempts, unless they are still to be sent; how many."""
        off = select(WebhookRow.id).where(WebhookRow.enabled.is_(False))
        over = or_(WebhookDeliveryRow.status != "pending", WebhookDeliveryRow.webhook_id.in_(off))
        found = self._session.execute(delete(WebhookDeliveryRow).where(WebhookDeliveryRow.created_at < moment, over))
        assert isinstance(found, CursorResult)
        return found.rowcount


def _due(now: datetime | BindParameter[datetime]) -> ColumnElement[bool]:
    return and_(
        WebhookDeliveryRow.status == "pending",
        WebhookDeliveryRow.next_attempt_at <= now,
        WebhookRow.enabled.is_(True),
        or_(WebhookRow.rests_until.is_(None), WebhookRow.rests_until <= now),
    )


_ANY_DUE = (
    select(WebhookDeliveryRow.id)
    .join(WebhookRow, WebhookRow.id == WebhookDeliveryRow.webhook_id)
    .where(_due(bindparam("now", type_=UtcDateTime())))
    .limit(1)
)  # built once


def is_any_due(connection: Connection, now: datetime) -> bool:
    """Whether there is something to claim: asked every second by every worker, hence of the connection itself."""
    return connection.execute(_ANY_DUE, {"now": now}).first() is not None
