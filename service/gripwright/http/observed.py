"""What every answer has, and what is counted of it."""

from collections import Counter

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send


class Observed:
    """ASGI middleware: security headers on every answer, and a count of answers by method, route and status."""

    def __init__(self, app: ASGIApp, *, requests: Counter[tuple[str, str, int]]) -> None:
        self._app, self._requests = app, requests

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and see its answer off."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def observed(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.setdefault("X-Content-Type-Options", "nosniff")
                headers.setdefault("Referrer-Policy", "no-referrer")
                route = getattr(scope.get("route"), "path", "")
                self._requests[scope["method"], route, message["status"]] += 1
            await send(message)

        await self._app(scope, receive, observed)
