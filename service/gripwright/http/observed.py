"""What every answer has, and what is counted and told of it."""

import logging
import re
import time
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from structlog.contextvars import bound_contextvars

from gripwright.http.deprecation import tell_deprecation
from gripwright.http.metrics import Metrics
from gripwright.http.places import Places
from gripwright.logs import FIELDS
from gripwright.traces import TracePlace, place_below

if TYPE_CHECKING:
    from gripwright.tracer import Tracer

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
_ID_OF_CALLER = re.compile(r"[A-Za-z0-9._-]{1,64}")

_log = logging.getLogger("gripwright.access")


class Observed:
    """ASGI middleware: security headers and an id on every answer; each is counted, timed and told to the log."""

    def __init__(self, app: ASGIApp, *, places: Places, metrics: Metrics, tracer: "Tracer | None") -> None:
        self._app, self._places, self._metrics, self._tracer = app, places, metrics, tracer

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and see its answer off."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers, started_s, start_ns = Headers(scope=scope), time.monotonic(), time.time_ns()
        trace, given = place_below(headers.get("traceparent", "")), headers.get(REQUEST_ID, "")
        request_id = given if _ID_OF_CALLER.fullmatch(given) else trace.trace_id
        scope.setdefault("state", {}).update(request_id=request_id, trace=trace)
        self._places.mark(scope)
        status = 500  # where no answer begins: the connection is closed on the caller

        async def observed(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                answered = MutableHeaders(scope=message)
                for name, value in SECURITY_HEADERS.items():
                    answered.setdefault(name, value)
                answered[REQUEST_ID] = request_id
                tell_deprecation(scope.get("route"), answered)
            await send(message)

        with bound_contextvars(request_id=request_id, trace_id=trace.trace_id):
            try:
                await self._app(scope, receive, observed)
            finally:
                self._answered(scope, status, time.monotonic() - started_s)
                self._tell(scope, status, trace, start_ns)

    def _answered(self, scope: Scope, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "")
        self._metrics.request_answered(scope["method"], route, status, seconds)
        fields = {
            "method": scope["method"],
            "path": scope["path"],
            "route": route,
            "status": status,
            "duration_s": round(seconds, 4),
            "actor": scope["state"].get("actor", ""),
            "client": scope["client"][0] if scope.get("client") else "",
        }
        _log.info("%s %s %d", scope["method"], scope["path"], status, extra={FIELDS: fields})

    def _tell(self, scope: Scope, status: int, place: TracePlace, start_ns: int) -> None:
        if self._tracer is None:
            return
        route = getattr(scope.get("route"), "path", "")
        attributes = {"http.request.method": scope["method"], "http.route": route, "http.response.status_code": status}
        failure = f"answered {status}" if status >= 500 else None
        name = f"{scope['method']} {route}".strip()
        self._tracer.tell(name, place, start_ns, time.time_ns(), attributes, error=failure, is_request=True)
