"""Bodies larger than allowed are refused before, or while, they arrive."""

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gripwright.http.errors import problem


class BodyLimit:
    """ASGI middleware: `upload_max_bytes` for uploads to `upload_paths`, `body_max_bytes` for everything else."""

    def __init__(self, app: ASGIApp, *, upload_paths: frozenset[str], upload_max_bytes: int, body_max_bytes: int) -> None:
        self._app, self._upload_paths = app, upload_paths
        self._upload_max_bytes, self._body_max_bytes = upload_max_bytes, body_max_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer 413, or pass the request on with its body counted."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit = self._upload_max_bytes if scope["path"] in self._upload_paths else self._body_max_bytes
        announced = Headers(scope=scope).get("content-length", "")
        if announced.isdigit() and int(announced) > limit:
            await problem(413, "limit-exceeded", _detail(int(announced), limit))(scope, receive, send)
            return
        await self._app(scope, _counting(receive, limit), send)


def _counting(receive: Receive, limit: int) -> Receive:
    received = 0

    async def counted() -> Message:
        nonlocal received
        message = await receive()
        received += len(message.get("body", b""))
        if received > limit:
            raise HTTPException(413, _detail(received, limit))
        return message

    return counted


def _detail(size: int, limit: int) -> str:
    return f"the body has {size} bytes or more, at most {limit}"
