"""Messages to webhooks, sent again with growing pauses until they are taken, several at a time but one to each receiver."""

import logging
import random
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime, timedelta
from http import HTTPStatus

from gripwright.jobs.webhook_signing import signed_headers
from gripwright.jobs.webhook_targets import Outcome, Sender
from gripwright.settings import Settings
from gripwright.store.columns import new_id, utc_now
from gripwright.store.engines import Database
from gripwright.store.models import WebhookAttemptRow, WebhookDeliveryRow, WebhookRow
from gripwright.store.webhooks import DeliveryRepository, is_any_due

_log = logging.getLogger(__name__)

_AT_A_TIME = 8
_LEASE = timedelta(seconds=60)  # longer than any attempt: a worker that died gives its message back
_IDLE_S = 1.0
_END_S = 3.0  # of attempts under way when the worker ends; one that is cut off is repeated by another worker
_CLEARING = timedelta(hours=1)
_PAUSES_S = (5, 30, 120, 600, 1800, 7200, 21600)  # after the 1st, 2nd, … failure; the last one repeats
_JITTER = 0.2  # of a pause at most, so that what failed together does not come back together
_REST_MAX = timedelta(days=1)  # that a receiver may ask for


def pause_after(attempts: int) -> timedelta:
    """How long to wait after that many failed attempts."""
    pause_s = _PAUSES_S[min(attempts, len(_PAUSES_S)) - 1]
    return timedelta(seconds=pause_s * (1.0 + random.uniform(0.0, _JITTER)))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Message:
    id: str
    url: str
    payload: str
    keys: list[str]  # that sign it


class DeliveryLoop:
    """Sends what is due. Any number of them may run, in any number of processes."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._database = Database(settings.resolved_database_url)
        self._sender = Sender(allow_private=settings.webhook_private_targets)
        self._stopped = threading.Event()
        self._free = threading.Semaphore(_AT_A_TIME)
        self._senders = ThreadPoolExecutor(max_workers=_AT_A_TIME, thread_name_prefix="webhook")
        self._thread = threading.Thread(target=self._run, name="webhooks", daemon=True)
        self._next_clearing: datetime | None = None

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    def stop(self) -> None:
        """Finish the attempts under way, if that takes no long time, and end."""
        self._stopped.set()
        self._thread.join(_END_S)
        for _ in range(_AT_A_TIME):
            if not self._free.acquire(timeout=_END_S / _AT_A_TIME):
                break
        self._senders.shutdown(wait=False)

    def deliver_next(self, now: datetime) -> bool:
        """Send the message that is due longest; whether there was one."""
        message = self._claim(now)
        if message is None:
            return False
        self._deliver(message, now)
        return True

    def clear(self, now: datetime) -> None:
        """Remove messages that are over and older than the settings say, at most once an hour."""
        if self._next_clearing is None or now >= self._next_clearing:
            self._next_clearing = now + _CLEARING
            with self._database.write_sessions.begin() as session:
                DeliveryRepository(session).remove_before(now - timedelta(days=self._settings.webhook_days))

    def _run(self) -> None:
        while not self._stopped.is_set():
            self._free.acquire()
            message = self._next()
            if message is None:
                self._free.release()
                self._stopped.wait(_IDLE_S)
            else:
                self._senders.submit(self._deliver_and_release, message)

    def _next(self) -> _Message | None:
        try:
            self.clear(utc_now())
            return self._claim(utc_now())
        except Exception:  # noqa: BLE001 - the job boundary: a fault of the database now must not end the thread
            _log.exception("the messages to webhooks that are due could not be read")
            return None

    def _deliver_and_release(self, message: _Message) -> None:
        try:
            self._deliver(message, utc_now())
        except Exception:  # noqa: BLE001 - the job boundary: the lease ends, and the message is sent again
            _log.exception("a message to a webhook could not be settled")
        finally:
            self._free.release()

    def _claim(self, now: datetime) -> _Message | None:
        with self._database.glance() as connection:  # most looks find nothing, and should not keep writers waiting
            if not is_any_due(connection, now):
                return None
        with self._database.write_sessions.begin() as session:
            claimed = DeliveryRepository(session).claim(now, _LEASE)
            if claimed is None:
                return None
            delivery, webhook = claimed
            return _Message(id=delivery.id, url=webhook.url, payload=delivery.payload, keys=_keys(webhook, now))

    def _deliver(self, message: _Message, now: datetime) -> None:
        headers = signed_headers(message.keys, message.id, int(now.timestamp()), message.payload)
        outcome = self._sender.send(message.url, message.payload, headers, now)
        with self._database.write_sessions.begin() as session:
            found = DeliveryRepository(session).find(message.id)
            if found is not None:
                session.add(_attempt(message.id, outcome, now))
                self._settle(*found, outcome, now)

    def _settle(self, delivery: WebhookDeliveryRow, webhook: WebhookRow, outcome: Outcome, now: datetime) -> None:
        """What becomes of a message and of its subscriber."""
        delivery.detail, webhook.rests_until = outcome.error, None
        if not outcome.error:
            delivery.status, webhook.failing_since = "delivered", None
            return
        webhook.failing_since = webhook.failing_since or now
        rest = min(timedelta(seconds=outcome.retry_after_s), _REST_MAX)
        if rest:
            webhook.rests_until = now + rest
        is_gone = outcome.status_code == HTTPStatus.GONE
        is_over = is_gone or delivery.attempts >= self._settings.webhook_attempts
        delivery.status = "failed" if is_over else "pending"
        if not is_over:
            delivery.next_attempt_at = now + max(pause_after(delivery.attempts), rest)
        if is_gone:
            _disable(webhook, "its receiver answered 410 Gone")
        elif now - webhook.failing_since >= timedelta(days=self._settings.webhook_failing_days):
            _disable(webhook, f"nothing was accepted since {webhook.failing_since:%Y-%m-%d %H:%M} UTC; at last: {outcome.error}")


def _keys(webhook: WebhookRow, now: datetime) -> list[str]:
    """The secrets that sign: the new one, and the old one until it expires."""
    expires_at = webhook.old_secret_expires_at
    is_old_valid = webhook.old_secret is not None and expires_at is not None and now < expires_at
    return [webhook.secret, *([webhook.old_secret] if is_old_valid and webhook.old_secret else [])]


def _attempt(delivery_id: str, outcome: Outcome, now: datetime) -> WebhookAttemptRow:
    return WebhookAttemptRow(
        id=new_id(now),
        delivery_id=delivery_id,
        started_at=now,
        duration_s=outcome.duration_s,
        status_code=outcome.status_code,
        error=outcome.error,
        response=outcome.response,
    )


def _disable(webhook: WebhookRow, reason: str) -> None:
    _log.warning("webhook %s is disabled: %s", webhook.id, reason)
    webhook.enabled, webhook.disabled_reason = False, reason
    webhook.rests_until = None
