"""Messages and their signatures as Standard Webhooks says (https://www.standardwebhooks.com)."""

import base64
import hashlib
import hmac
import json
import secrets
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

_PREFIX = "whsec_"


def new_secret() -> str:
    """A key of 32 random bytes, written as the standard says."""
    return _PREFIX + base64.b64encode(secrets.token_bytes(32)).decode()


def signature(secret: str, message_id: str, timestamp: int, payload: str) -> str:
    """`v1,` and the base64 HMAC-SHA256 of id, timestamp and payload."""
    key = base64.b64decode(secret.removeprefix(_PREFIX))
    signed = f"{message_id}.{timestamp}.{payload}".encode()
    return "v1," + base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()


def signed_headers(keys: Sequence[str], message_id: str, timestamp: int, payload: str) -> dict[str, str]:
    """The headers of one attempt; a signature for each of the keys, so that a receiver may know either."""
    return {
        "content-type": "application/json",
        "webhook-id": message_id,
        "webhook-timestamp": str(timestamp),
        "webhook-signature": " ".join(signature(key, message_id, timestamp, payload) for key in keys),
    }


def trial_payload(webhook_id: str, now: datetime) -> str:
    """A message that says nothing, to try a receiver with."""
    data: Mapping[str, Any] = {"webhook_id": webhook_id}
    return json.dumps({"type": "webhook.test", "timestamp": now.isoformat(), "data": data}, separators=(",", ":"))
