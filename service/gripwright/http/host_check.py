"""Where no key is asked, no page may reach the service under a name that was bound to this machine meanwhile."""

import re

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from gripwright.http.errors import problem
from gripwright.settings import is_loopback

_REFUSAL = "the service answers under the names of loopback and those that GRIPWRIGHT_ALLOWED_HOSTS lists"
_PORT = re.compile(r":\d*$")


class HostCheck:
    """ASGI middleware: 421 for a `Host` that is neither a name of this machine's loopback nor allowed."""

    def __init__(self, app: ASGIApp, *, allowed: tuple[str, ...]) -> None:
        self._app, self._allowed = app, frozenset(name.lower() for name in allowed)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or refuse it."""
        if scope["type"] == "http" and not self._is_ours(Headers(scope=scope).get("host", "")):
            await problem(421, "host-refused", _REFUSAL)(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _is_ours(self, host: str) -> bool:
        name = _PORT.sub("", host.lower()).removesuffix(".")
        return is_loopback(name.removeprefix("[").removesuffix("]")) or name.endswith(".localhost") or name in self._allowed
