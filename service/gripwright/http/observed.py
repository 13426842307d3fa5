"""What every answer has, and what is counted of it."""

import re
import secrets
from collections import Counter
from collections.abc import Mapping
from types import MappingProxyType

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gripwright.http.trace_context import TraceParent, parse_traceparent

SECURITY_HEADERS: Mapping[str, str] = MappingProxyType(
    {
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "X-Frame-Options": "DENY",
        "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
        "Cross-Origin-Resource-Policy": "same-origin",
    }
)
"""On every answer that does not set them itself."""

REQUEST_ID = "X-Request-ID"
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})  # any other word is counted as one
_ID_OF_CALLER = re.compile(r"[A-Za-z0-9._-]{1,64}")


class Observed:
    """ASGI middleware: security headers and an id on every answer, and a count of answers by method, route and status."""

    def __init__(self, app: ASGIApp, *, requests: Counter[tuple[str, str, int]]) -> None:
        self._app, self._requests = app, requests

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and see its answer off."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        state = scope.setdefault("state", {})
        state["traceparent"] = parse_traceparent(Headers(scope=scope).get("traceparent", ""))
        request_id = state["request_id"] = _request_id(Headers(scope=scope).get(REQUEST_ID, ""), state["traceparent"])

        async def observed(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in SECURITY_HEADERS.items():
                    headers.setdefault(name, value)
                headers[REQUEST_ID] = request_id
                if "deprecation" in state:
                    state["deprecation"].tell(headers)
                route = getattr(scope.get("route"), "path", "")
                method = scope["method"] if scope["method"] in _METHODS else "other"
                self._requests[method, route, message["status"]] += 1
            await send(message)

        await self._app(scope, receive, observed)


def _request_id(given: str, trace: TraceParent | None) -> str:
    """The caller's own id, else that of the caller's trace, else a new one of the same form."""
    if _ID_OF_CALLER.fullmatch(given):
        return given
    return secrets.token_hex(16) if trace is None else trace.trace_id
