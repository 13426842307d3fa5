"""`Idempotency-Key`: a POST that is sent again is answered again, and its effect happens once.

The answer is stored in the transaction of the effect, so that a process that ends between the two leaves both or neither.
"""

import asyncio
import hashlib
import logging
import re
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime, timedelta
from typing import Any

from fastapi import Request
from fastapi.concurrency import run_in_threadpool
from fastapi.routing import APIRoute
from sqlalchemy.exc import IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gripwright.domain.access import Principal
from gripwright.domain.errors import Fault, GripwrightError, InvalidInput
from gripwright.http.errors import KeyReused, RequestInFlight, database_problem, domain_problem, problem
from gripwright.http.fingerprint import Fingerprint
from gripwright.store.columns import new_id, utc_now
from gripwright.store.engines import DATABASE_FAILURES, Database
from gripwright.store.idempotency import IdempotencyRepository, KeptAnswer, KeyClaim

_log = logging.getLogger(__name__)

HEADER = "Idempotency-Key"
REPLAYED = "Idempotency-Replayed"
KEY_LENGTH = 255
KEY_PATTERN = r"^[\x21-\x7e]([\x20-\x7e]*[\x21-\x7e])?$"

OF_THE_EFFECT = frozenset({"keyed", "write_session"})
"""In the state of a request: what belongs to its effect, and to no read that is made for its answer."""

LEASE = timedelta(seconds=30)
"""How long a request that does not say that it still works keeps its key."""

_RETRY_AFTER_S = 1
_RENEWAL_S = LEASE.total_seconds() / 3
_CLEARING = timedelta(hours=1)


class KeptAnswers:
    """Answers by the keys of their requests, in the database."""

    def __init__(self, database: Database, *, hours: int) -> None:
        self._database, self._kept = database, timedelta(hours=hours)
        self._next_clearing = datetime.min.replace(tzinfo=UTC)

    def claim(self, claim: KeyClaim, now: datetime) -> KeptAnswer | None:
        """The answer under this key, or None: then the key is the claim's. RequestInFlight where another request has it."""
        self.clear(now)
        try:
            with self._database.write_sessions.begin() as session:
                keys = IdempotencyRepository(session)
                row = keys.find(claim, now)
                if row is None:
                    keys.claim(claim, now, now + LEASE)
                    return None
        except IntegrityError:
            raise _in_flight() from None
        if row.status is None or row.request_sha256 is None or row.headers is None or row.body is None:
            raise _in_flight()
        headers = [(name, value) for name, value in row.headers]
        return KeptAnswer(request_sha256=row.request_sha256, status=row.status, headers=headers, body=row.body)

    def keep(self, session: Session, claim: KeyClaim, answer: KeptAnswer) -> None:
        """Store an answer in the transaction of its effect."""
        IdempotencyRepository(session).keep(claim, answer, utc_now() + self._kept)

    def keep_alone(self, claim: KeyClaim, answer: KeptAnswer) -> None:
        """Store an answer that has no effect to go with."""
        with self._database.write_sessions.begin() as session:
            self.keep(session, claim, answer)

    def renew(self, claim: KeyClaim) -> None:
        """Say that the request is still worked on."""
        with self._database.write_sessions.begin() as session:
            IdempotencyRepository(session).extend(claim, utc_now() + LEASE)

    def release(self, claim: KeyClaim) -> None:
        """Give the key back unanswered."""
        with self._database.write_sessions.begin() as session:
            IdempotencyRepository(session).release(claim)

    def clear(self, now: datetime) -> None:
        """Remove what has expired, at most once an hour."""
        if now < self._next_clearing:
            return
        self._next_clearing = now + _CLEARING
        with self._database.write_sessions.begin() as session:
            IdempotencyRepository(session).remove_expired(now)


class KeyedRequest:
    """A request that holds its key: what the middleware and the route share."""

    def __init__(self, claim: KeyClaim, fingerprint: Fingerprint, answers: KeptAnswers) -> None:
        self.claim, self.fingerprint, self._answers = claim, fingerprint, answers
        self.kept_status: int | None = None

    async def keep(self, status: int, headers: Headers, body: bytes, session: Session | None) -> None:
        """Store the answer: in the session of the effect, or in one of its own."""
        answer = KeptAnswer(
            request_sha256=await self.fingerprint.digest(),
            status=status,
            headers=[(name, value) for name, value in headers.items() if name != "content-length"],
            body=body,
        )
        if session is None:
            await run_in_threadpool(self._answers.keep_alone, self.claim, answer)
        else:
            await run_in_threadpool(self._answers.keep, session, self.claim, answer)
        self.kept_status = status


class ActingRoute(APIRoute):
    """A route whose POST stores its answer in the transaction of its effect, where the request has a key."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The framework's handler; the session that it was given is open still when it returns."""
        handle = super().get_route_handler()

        async def handle_and_keep(request: Request) -> Response:
            response = await handle(request)
            keyed: KeyedRequest | None = getattr(request.state, "keyed", None)
            session: Session | None = getattr(request.state, "write_session", None)
            if keyed is not None and session is not None:
                await keyed.keep(response.status_code, response.headers, bytes(response.body), session)
            return response

        return handle_and_keep


class Idempotent:
    """ASGI middleware: gives kept answers again, and keeps those that no route has kept with its effect."""

    def __init__(self, app: ASGIApp, *, answers: KeptAnswers) -> None:
        self._app, self._answers = app, answers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer again, or let the request be answered under its key."""
        given = Headers(scope=scope).get(HEADER) if scope["type"] == "http" and scope["method"] == "POST" else None
        if given is None or "principal" not in scope["state"]:  # where anybody may ask, nothing is posted
            await self._app(scope, receive, send)
            return
        request, fingerprint = Request(scope), Fingerprint(scope, receive)
        try:
            claim = KeyClaim(caller_sha256=_caller_sha256(scope), key=_key(given), id=new_id(utc_now()))
            known = await run_in_threadpool(self._answers.claim, claim, utc_now())
            if known is not None:
                await _again(known, await fingerprint.digest())(scope, receive, send)
                return
        except GripwrightError as error:
            await domain_problem(request, error)(scope, receive, send)
        except HTTPException as error:  # the body is too large
            await problem(error.status_code, "limit-exceeded", str(error.detail))(scope, receive, send)
        except DATABASE_FAILURES as error:
            await database_problem(request, error)(scope, receive, send)
        except ClientDisconnect:
            return
        else:
            await self._answer(KeyedRequest(claim, fingerprint, self._answers), scope, send)

    async def _answer(self, keyed: KeyedRequest, scope: Scope, send: Send) -> None:
        scope["state"]["keyed"] = keyed
        renewing = asyncio.create_task(self._renew(keyed.claim))
        start: Message = {}
        body = bytearray()

        async def keeping(message: Message) -> None:
            """Hold back an answer that has to be kept until it is whole."""
            nonlocal start
            if message["type"] == "http.response.start":
                start = message
                return
            body.extend(message.get("body", b""))
            if message.get("more_body", False):
                return
            if start["status"] < 500 and start["status"] != keyed.kept_status:
                await self._keep_alone(keyed, start, bytes(body))
            await send(start)
            await send({"type": "http.response.body", "body": bytes(body)})

        try:
            await self._app(scope, keyed.fingerprint.receive, keeping)
        finally:
            renewing.cancel()
            if keyed.kept_status is None or keyed.kept_status != start.get("status"):
                await run_in_threadpool(self._answers.release, keyed.claim)

    async def _keep_alone(self, keyed: KeyedRequest, start: Message, body: bytes) -> None:
        """Keep an answer without an effect. Where that fails it is sent all the same: a repetition is answered anew."""
        try:
            await keyed.keep(start["status"], Headers(raw=start["headers"]), body, None)
        except (GripwrightError, SQLAlchemyError):
            _log.exception("the answer to a request with an Idempotency-Key is not kept")
        except (ClientDisconnect, HTTPException):
            pass  # of a body that was refused before it had arrived nobody can say whether another is the same

    async def _renew(self, claim: KeyClaim) -> None:
        while True:
            await asyncio.sleep(_RENEWAL_S)
            try:
                await run_in_threadpool(self._answers.renew, claim)
            except SQLAlchemyError:
                _log.exception("the Idempotency-Key of a request in work could not be renewed")


def _in_flight() -> RequestInFlight:
    return RequestInFlight("another request with this Idempotency-Key is being answered: ask again", retry_after_s=_RETRY_AFTER_S)


def _caller_sha256(scope: Scope) -> str:
    principal: Principal = scope["state"]["principal"]
    return hashlib.sha256(principal.actor.encode("utf-8", "surrogatepass")).hexdigest()


def _key(given: str) -> str:
    """The key that a header names, with or without the quotes of a structured field."""
    key = given[1:-1] if len(given) > 1 and given[0] == given[-1] == '"' else given
    if len(key) > KEY_LENGTH or re.fullmatch(KEY_PATTERN, key) is None:
        message = f"must be 1 to {KEY_LENGTH} printable ASCII characters"
        raise InvalidInput("the Idempotency-Key cannot be used", faults=(Fault(f"/header/{HEADER}", message),))
    return key


def _again(known: KeptAnswer, request_sha256: str) -> Response:
    """The answer that was kept; KeyReused where the request is another than it answered."""
    if known.request_sha256 != request_sha256:
        raise KeyReused("this Idempotency-Key was used for another request")
    return Response(known.body, known.status, headers={**dict(known.headers), REPLAYED: "true"})
