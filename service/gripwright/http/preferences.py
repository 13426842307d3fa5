"""The `Prefer` header (RFC 7240): `respond-async`, and `wait=n` seconds."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

PREFER: dict[str, Any] = {
    "parameters": [
        {
            "name": "Prefer",
            "in": "header",
            "required": False,
            "schema": {"type": "string"},
            "description": "`wait=n`: answer when the design has ended, at the latest after n seconds; `respond-async`: at once",
            "examples": {"wait": {"value": "wait=30"}, "at once": {"value": "respond-async"}},
        }
    ]
}
"""Of an operation that takes it, for the documentation."""

_DIGITS = 9  # more seconds than anybody waits


@dataclass(frozen=True, slots=True)
class Preferences:
    """What a caller prefers; of a preference that is given twice the first counts."""

    wait_s: int | None
    respond_async: bool


def preferences(headers: Iterable[str]) -> Preferences:
    """What `Prefer` headers ask for. What is not understood is passed over, as the RFC says."""
    given: dict[str, str] = {}
    for part in ",".join(headers).split(","):
        name, _, value = part.partition(";")[0].partition("=")
        given.setdefault(name.strip().lower(), value.strip().strip('"'))
    word = given.get("wait", "")
    is_number = word.isascii() and word.isdigit() and len(word) <= _DIGITS
    return Preferences(wait_s=int(word) if is_number else None, respond_async="respond-async" in given)
