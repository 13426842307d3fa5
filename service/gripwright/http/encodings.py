"""Answers as gzip where the caller takes it; bodies that are encoded are refused."""

import gzip
import re
from collections.abc import Iterable

from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gripwright.http.errors import problem

LEAST_BYTES = 1024
"""Shorter answers gain nothing."""

_LEVEL = 5
_ASIDE_BYTES = 2**16  # longer ones are encoded by a thread, meanwhile others are answered
_TYPES = re.compile(r"(text/(?!event-stream)|application/([\w.+-]+\+)?json)")
_TAG = re.compile(r'((?:W/)?"[^"]*)-gzip"')
_CONDITIONS = (b"if-match", b"if-none-match")


class Encodings:
    """ASGI middleware. An encoded answer is another representation, with a tag of its own: `"7"` becomes `"7-gzip"`.

    Conditions name either, and handlers see the tag that they gave. Files are sent as they are, for their ranges.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse an encoded body, else pass the request on and encode its answer."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        asked = Headers(scope=scope)
        encoding = asked.get("content-encoding", "identity").strip().lower()
        if encoding not in ("identity", ""):
            detail = f"bodies are read as they are, this one is {encoding}"
            answer = problem(415, "unsupported-media-type", detail, headers={"Accept-Encoding": "identity"})
            await answer(scope, receive, send)
            return
        takes = accepts_gzip(asked.get("accept-encoding", ""))
        knows_encoded = _TAG.search(asked.get("if-none-match", "")) is not None
        start: Message = {}

        async def encoding_send(message: Message) -> None:
            nonlocal start
            if message["type"] == "http.response.start":
                if message["status"] == 304:
                    headers = MutableHeaders(scope=message)
                    headers.add_vary_header("Accept-Encoding")  # what it stands for has it, or is too short to be encoded
                    if knows_encoded:
                        _tag_as_gzip(headers)
                if _may_be_encoded(Headers(raw=message["headers"])):
                    start = message  # held back, for what follows may change its headers
                    return
            elif start:
                begun, start = start, {}
                message = await _encoded(begun, message, takes=takes)
                await send(begun)
            await send(message)

        await self._app({**scope, "headers": list(_plain_tags(scope["headers"]))}, receive, encoding_send)


def accepts_gzip(accept_encoding: str) -> bool:
    """Whether the header allows gzip (RFC 9110): by its name, or else by `*`, with a weight that is not 0."""
    weights = {}
    for part in accept_encoding.lower().split(","):
        name, *parameters = (word.strip() for word in part.split(";"))
        refused = any(re.fullmatch(r"q=0(\.0*)?", parameter) for parameter in parameters)
        weights[name] = not refused
    return weights.get("gzip", weights.get("*", False))


def _may_be_encoded(headers: Headers) -> bool:
    """Whether an answer is text that is neither a file nor a stream."""
    is_file = "accept-ranges" in headers or "content-encoding" in headers
    return not is_file and _TYPES.match(headers.get("content-type", "")) is not None


async def _encoded(start: Message, first: Message, *, takes: bool) -> Message:
    """The first part of the body, encoded where it is all of it and that is worth it; the headers are changed to match."""
    headers = MutableHeaders(scope=start)
    body = first.get("body", b"")
    if first.get("more_body", False) or len(body) < LEAST_BYTES:
        return first
    headers.add_vary_header("Accept-Encoding")
    if not takes:
        return first
    data = await run_in_threadpool(_gzip, body) if len(body) > _ASIDE_BYTES else _gzip(body)
    headers["Content-Encoding"] = "gzip"
    headers["Content-Length"] = str(len(data))
    _tag_as_gzip(headers)
    return {**first, "body": data}


def _gzip(body: bytes) -> bytes:
    return gzip.compress(body, _LEVEL, mtime=0)  # the same answer, the same bytes


def _tag_as_gzip(headers: MutableHeaders) -> None:
    """Give the encoded answer a strong tag of its own."""
    tag = headers.get("etag", "W/")
    if not tag.startswith("W/"):
        headers["ETag"] = tag.removesuffix('"') + '-gzip"'


def _plain_tags(headers: Iterable[tuple[bytes, bytes]]) -> Iterable[tuple[bytes, bytes]]:
    for name, value in headers:
        yield name, _TAG.sub(r'\1"', value.decode("latin-1")).encode("latin-1") if name in _CONDITIONS else value
