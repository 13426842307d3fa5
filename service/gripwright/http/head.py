"""HEAD wherever there is GET: the same answer without its body (RFC 9110, 9.3.2)."""

from starlette.types import ASGIApp, Message, Receive, Scope, Send

IS_HEAD = "is_head"
"""In the state of a request: only the headers of its answer are sent."""

STREAM = "/events"
"""How paths of streams end, which have no HEAD: it would go on until the job has ended, and nothing of it be sent."""


class Head:
    """ASGI middleware: inside of it a HEAD is a GET."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and hold its body back."""
        if scope["type"] != "http" or scope["method"] != "HEAD" or scope["path"].endswith(STREAM):
            await self._app(scope, receive, send)
            return
        scope.setdefault("state", {})[IS_HEAD] = True
        is_over = False

        async def bodiless(message: Message) -> None:
            nonlocal is_over
            if message["type"] == "http.response.start":
                await send(message)
            elif not is_over:
                is_over = not message.get("more_body", False)
                if is_over:
                    await send({"type": "http.response.body", "body": b""})

        await self._app({**scope, "method": "GET"}, receive, bodiless)
