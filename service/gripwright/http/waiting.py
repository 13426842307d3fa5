"""Answers that wait until a design has ended, where the caller prefers that: no thread and no connection is held meanwhile."""

import asyncio
import logging
import re
from collections.abc import Iterable, Mapping

from fastapi.concurrency import run_in_threadpool
from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gripwright.http.idempotency import OF_THE_EFFECT, REPLAYED
from gripwright.http.preferences import Preferences, preferences
from gripwright.store.designs import JobRepository
from gripwright.store.engines import Database

POLL_S = 0.1
_log = logging.getLogger(__name__)
_REQUESTED = re.compile(r"/api/v1/products/[^/]+/designs")
_READ = re.compile(r"/api/v1/(?:designs|jobs)/([^/]+)")
_OF_THE_REQUEST = (b"content-length", b"content-type", b"if-none-match", b"range")


class EndWatch:
    """Tells those who wait that a job has ended: one short query after another for all of them, none where nobody waits."""

    def __init__(self, database: Database, *, seats: int) -> None:
        self._database, self._seats = database, seats
        self._waiting: list[tuple[str, asyncio.Event]] = []
        self._poller: asyncio.Task[None] | None = None

    async def wait(self, job_id: str, timeout_s: float) -> bool:
        """Wait until a job has ended or is gone, or the time is over; False, at once, where as many wait as may."""
        if len(self._waiting) >= self._seats:
            return False
        seat = (job_id, asyncio.Event())
        self._waiting.append(seat)
        if self._poller is None or self._poller.done():
            self._poller = asyncio.create_task(self._poll())
        try:
            await asyncio.wait_for(seat[1].wait(), timeout_s)
        except TimeoutError:
            pass
        finally:
            self._waiting.remove(seat)
        return True

    def has_ended(self, job_id: str) -> bool:
        """Whether a job is known to have ended, or to be gone."""
        try:
            return not self._unfinished((job_id,))
        except SQLAlchemyError:
            _log.exception("whether a job has ended cannot be read")
            return False

    async def _poll(self) -> None:
        while self._waiting:
            try:
                unfinished = await run_in_threadpool(self._unfinished, {job_id for job_id, _ in self._waiting})
            except SQLAlchemyError:
                _log.exception("whether jobs have ended cannot be read")
            else:
                for job_id, event in self._waiting:
                    if job_id not in unfinished:
                        event.set()
            await asyncio.sleep(POLL_S)

    def _unfinished(self, job_ids: Iterable[str]) -> set[str]:
        with self._database.read_sessions() as session:
            return JobRepository(session).unfinished(job_ids)


class Waiting:
    """ASGI middleware: `Prefer: wait=n` on a request for a design, and on reads of a design or a job."""

    def __init__(self, app: ASGIApp, *, watch: EndWatch, wait_max_s: int) -> None:
        self._app, self._watch, self._wait_max_s = app, watch, wait_max_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on; wait before a read, or after a request for a design."""
        wanted = preferences(Headers(scope=scope).getlist("prefer")) if scope["type"] == "http" else Preferences(None, False)
        read = _READ.fullmatch(scope["path"]) if wanted.wait_s is not None and scope["method"] == "GET" else None
        if read is not None:
            applied = await self._wait(read[1], wanted)
            await self._app(scope, receive, _with_preference(send, applied))
        elif wanted != Preferences(None, False) and scope["method"] == "POST" and _REQUESTED.fullmatch(scope["path"]):
            await self._request(scope, receive, send, wanted)
        else:
            await self._app(scope, receive, send)

    async def _wait(self, job_id: str, wanted: Preferences) -> str:
        """Wait as long as is preferred and allowed; what was applied of the preferences."""
        wait_s = min(wanted.wait_s or 0, self._wait_max_s)
        return f"wait={wait_s}" if await self._watch.wait(job_id, wait_s) else ""

    async def _request(self, scope: Scope, receive: Receive, send: Send, wanted: Preferences) -> None:
        """Send the design itself as 201 where it has ended in time, else what was answered to the request."""
        messages: list[Message] = []

        async def keep(message: Message) -> None:
            messages.append(message)

        await self._app(dict(scope), receive, keep)
        start = messages[0]
        headers = Headers(raw=start["headers"])
        location = headers.get("location")
        applied = "respond-async" if wanted.respond_async and start["status"] == 202 else ""
        if start["status"] == 202 and location is not None and wanted.wait_s is not None:
            job_id = location.rpartition("/")[2]
            waited = await self._wait(job_id, wanted)
            applied = ", ".join(filter(None, (applied, waited)))
            has_ended = await run_in_threadpool(self._watch.has_ended, job_id)
            if waited and has_ended:
                told = {"Location": location, **({REPLAYED: headers[REPLAYED]} if REPLAYED in headers else {})}
                await self._app(_read_of(scope, location), receive, _as_created(_with_preference(send, waited), told))
                return
        deliver = _with_preference(send, applied)
        for message in messages:
            await deliver(message)


def _read_of(scope: Scope, location: str) -> Scope:
    """The read of what a request has made, in its name."""
    headers = [(name, value) for name, value in scope["headers"] if name not in _OF_THE_REQUEST]
    path = {"path": location, "raw_path": location.encode(), "query_string": b""}
    state = {name: value for name, value in scope["state"].items() if name not in OF_THE_EFFECT}
    return {**scope, **path, "method": "GET", "headers": headers, "state": state}


def _as_created(send: Send, told: Mapping[str, str]) -> Send:
    async def created(message: Message) -> None:
        if message["type"] == "http.response.start" and message["status"] == 200:
            message["status"] = 201
            MutableHeaders(scope=message).update(told)
        await send(message)

    return created


def _with_preference(send: Send, applied: str) -> Send:
    async def told(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.add_vary_header("Prefer")
            if applied and message["status"] < 400:
                headers["Preference-Applied"] = applied
        await send(message)

    return told
