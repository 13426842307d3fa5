"""Messages to webhooks, signed as Standard Webhooks says and sent again with growing pauses until they are taken."""

import base64
import hashlib
import hmac
import ipaddress
import logging
import secrets
import socket
import threading
from datetime import datetime, timedelta
from urllib.parse import urlsplit

import httpx

from gripwright.domain.errors import Fault, InvalidInput
from gripwright.settings import Settings
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.webhooks import DeliveryRepository

_log = logging.getLogger(__name__)

_PREFIX = "whsec_"
_TIMEOUT_S = 10.0
_LEASE = timedelta(seconds=60)  # longer than any attempt: a worker that died gives its message back
_IDLE_S = 1.0
_PAUSES_S = (5, 30, 120, 600, 1800, 7200, 21600)  # after the 1st, 2nd, … failure; the last one repeats


def new_secret() -> str:
    """A key of 24 random bytes, written as the standard says."""
    return _PREFIX + base64.b64encode(secrets.token_bytes(24)).decode()


def signature(secret: str, message_id: str, timestamp: int, payload: str) -> str:
    """`v1,` and the base64 HMAC-SHA256 of id, timestamp and payload."""
    key = base64.b64decode(secret.removeprefix(_PREFIX))
    signed = f"{message_id}.{timestamp}.{payload}".encode()
    return "v1," + base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()


def check_target(url: str, *, allow_private: bool) -> None:
    """InvalidInput where the host does not resolve, or to an address that is not public."""
    parts = urlsplit(url)
    port = parts.port or (443 if parts.scheme == "https" else 80)
    try:
        found = socket.getaddrinfo(parts.hostname, port, type=socket.SOCK_STREAM)
    except OSError as error:
        raise _refused(f"the host does not resolve: {error}") from None
    for *_, address in found:
        if not allow_private and not ipaddress.ip_address(str(address[0]).partition("%")[0]).is_global:
            raise _refused(f"{parts.hostname} is {address[0]}, which is not a public address")


def _refused(reason: str) -> InvalidInput:
    return InvalidInput("the webhook's target is refused", faults=(Fault(pointer="/url", message=reason),))


def pause_after(attempts: int) -> timedelta:
    """How long to wait after that many failed attempts."""
    return timedelta(seconds=_PAUSES_S[min(attempts, len(_PAUSES_S)) - 1])


class DeliveryLoop:
    """A thread that sends what is due. Any number of them may run, in any number of processes."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._database = Database(settings.resolved_database_url)
        self._client = httpx.Client(timeout=_TIMEOUT_S, follow_redirects=False)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="webhooks", daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    def stop(self) -> None:
        """Finish the attempt under way and end."""
        self._stopped.set()
        self._thread.join(_TIMEOUT_S)
        self._client.close()
        self._database.dispose()

    def _run(self) -> None:
        while not self._stopped.is_set():
            try:
                was_due = self.deliver_next(utc_now())
            except Exception:  # noqa: BLE001 - the job boundary: a fault of the database now must not end the thread
                _log.exception("webhooks could not be delivered")
                was_due = False
            if not was_due:
                self._stopped.wait(_IDLE_S)

    def deliver_next(self, now: datetime) -> bool:
        """Send the message that is due longest; whether there was one."""
        with self._database.write_sessions.begin() as session:
            claimed = DeliveryRepository(session).claim(now, _LEASE)
            if claimed is None:
                return False
            delivery, webhook = claimed
            message_id, payload, attempts = delivery.id, delivery.payload, delivery.attempts
            url, secret = webhook.url, webhook.secret
        failure = self._send(url, secret, message_id, payload, now)
        is_over = failure is None or attempts >= self._settings.webhook_attempts
        status = "delivered" if failure is None else "failed" if is_over else "pending"
        with self._database.write_sessions.begin() as session:
            DeliveryRepository(session).settle(
                message_id, status=status, detail=failure or "", next_attempt_at=now if is_over else now + pause_after(attempts)
            )
        return True

    def _send(self, url: str, secret: str, message_id: str, payload: str, now: datetime) -> str | None:
        """Send a message; why it was not taken, or None."""
        timestamp = int(now.timestamp())
        headers = {
            "content-type": "application/json",
            "webhook-id": message_id,
            "webhook-timestamp": str(timestamp),
            "webhook-signature": signature(secret, message_id, timestamp, payload),
        }
        try:
            check_target(url, allow_private=self._settings.webhook_private_targets)
            answer = self._client.post(url, content=payload, headers=headers)
        except InvalidInput as error:
            return error.faults[0].message
        except httpx.HTTPError as error:
            return f"{type(error).__name__}: {error}"
        return None if answer.is_success else f"answered {answer.status_code}"
