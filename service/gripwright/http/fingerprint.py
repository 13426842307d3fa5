"""The hash of a request, taken while its body passes by."""

import hashlib
from email.message import Message as MimeHeader

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import Message, Receive, Scope


class Fingerprint:
    """SHA-256 of method, path, query, media type and body. `receive` is the request's own, which the body passes through.

    The boundary of a multipart body does not count: clients invent another one for every attempt.
    """

    def __init__(self, scope: Scope, receive: Receive) -> None:
        self._receive, self._is_over = receive, False
        self._failure: HTTPException | None = None  # of a body that is too large: what came after it is not waited for
        media_type = MimeHeader()
        media_type["Content-Type"] = Headers(scope=scope).get("content-type", "")
        self._boundary = (media_type.get_boundary() or "").encode("latin-1", "replace")
        self._held = b""  # the end of what came, where a boundary may have begun
        self._hash = hashlib.sha256()
        for part in (scope["method"].encode(), scope["path"].encode(), scope["query_string"]):
            self._hash.update(part + b"\n")
        self._hash.update(media_type.get_content_type().encode("latin-1", "replace") + b"\n")

    async def receive(self) -> Message:
        """The next part of the body."""
        if self._failure is not None:
            raise self._failure
        try:
            message = await self._receive()
        except HTTPException as failure:
            self._failure = failure
            raise
        if message["type"] == "http.request" and not self._is_over:
            self._is_over = not message.get("more_body", False)
            self._add(message.get("body", b""))
        return message

    async def digest(self) -> str:
        """The hash, after what is left of the body has been read."""
        while not self._is_over:
            if (await self.receive())["type"] == "http.disconnect":
                raise ClientDisconnect
        return self._hash.hexdigest()

    def _add(self, data: bytes) -> None:
        if not self._boundary:
            self._hash.update(data)
            return
        *whole, rest = (self._held + data).split(self._boundary)
        for piece in whole:
            self._hash.update(piece)
        kept = 0 if self._is_over else len(self._boundary) - 1
        cut = max(len(rest) - kept, 0)
        self._hash.update(rest[:cut])
        self._held = rest[cut:]
