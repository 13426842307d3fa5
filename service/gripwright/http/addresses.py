"""Addresses whose percent-encoded bytes are no text are refused: they would name something else than the caller meant."""

from urllib.parse import unquote_to_bytes

from starlette.types import ASGIApp, Receive, Scope, Send

from gripwright.domain.errors import Fault
from gripwright.http.errors import problem


class Addresses:
    """ASGI middleware: 400 for a path or a query that is not UTF-8, or holds a NUL character, which no database stores."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer 400, or pass the request on."""
        if scope["type"] == "http":
            parts = (("/path", scope["raw_path"]), ("/query", scope["query_string"]))
            faults = [Fault(pointer, message) for pointer, raw in parts if (message := _fault(raw)) is not None]
            if faults:
                await problem(400, "bad-request", "the address is no text", faults=faults)(scope, receive, send)
                return
        await self._app(scope, receive, send)


def _fault(raw: bytes) -> str | None:
    text = unquote_to_bytes(raw)
    try:
        text.decode()
    except UnicodeDecodeError as error:
        return f"is not UTF-8: {error.reason} at byte {error.start}"
    return "holds a NUL character" if b"\0" in text else None
