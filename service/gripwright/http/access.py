"""Nobody gets past without the scope that the request needs, before a byte of its body is read."""

import time
from collections.abc import Mapping

from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from structlog.contextvars import bind_contextvars

from gripwright.domain.access import ANYBODY, AccessScope, NotAuthenticated, Principal
from gripwright.domain.errors import GripwrightError
from gripwright.http.audit_trail import AuditTrail, audit_row
from gripwright.http.errors import OriginRefused, database_problem, domain_problem, problem
from gripwright.http.gate import Gate, check_scope, required_scope
from gripwright.http.rate_limits import RateLimits
from gripwright.store.columns import utc_now
from gripwright.store.engines import DATABASE_FAILURES


class Access:
    """ASGI middleware: 401 without a valid credential, 403 without the scope; what was asked and answered is audited."""

    def __init__(self, app: ASGIApp, *, gate: Gate, audit: AuditTrail, limits: RateLimits, origins: tuple[str, ...]) -> None:
        self._app, self._gate, self._audit, self._limits, self._origins = app, gate, audit, limits, frozenset(origins)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let the request in, or answer it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        needed = required_scope(scope["method"], scope["path"])
        if needed is None:
            await self._app(scope, receive, send)
            return
        principal: Principal | None = None
        told: Mapping[str, str] = {}  # of the caller's limit

        async def audited(message: Message) -> None:
            if message["type"] == "http.response.start":
                now = utc_now()
                if self._audit.holds(scope["method"], message["status"], principal, now):
                    await run_in_threadpool(self._audit.write, audit_row(scope, message, principal, now))
                MutableHeaders(scope=message).update(told)
            await send(message)

        request = Request(scope)
        try:
            principal = scope["state"]["principal"] = await self._identify(request)
            bind_contextvars(actor=principal.actor)
            told = self._limits.admit(principal, _address(scope), reads=needed is AccessScope.READ, now_s=time.monotonic())
            check_scope(principal, needed)
            if principal is ANYBODY and needed is AccessScope.WRITE:
                self._check_origin(request.headers)
        except GripwrightError as error:
            await domain_problem(request, error)(scope, receive, audited)
        except DATABASE_FAILURES as error:
            await database_problem(request, error)(scope, receive, audited)
        else:
            request.state.actor = principal.actor
            await self._app(scope, receive, audited)

    async def _identify(self, request: Request) -> Principal:
        """Who asks. An address that has shown too many credentials that are none is not listened to."""
        credential = request.headers.get("authorization", "")
        if not credential:
            return await run_in_threadpool(self._gate.identify, credential, utc_now())
        address = _address(request.scope)
        self._limits.check_address(address, time.monotonic())
        try:
            return await run_in_threadpool(self._gate.identify, credential, utc_now())
        except NotAuthenticated:
            self._limits.count_failure(address, time.monotonic())
            raise

    def _check_origin(self, headers: Headers) -> None:
        """OriginRefused for a page of another site: where no key is asked its forms could do what they want, if not read it."""
        origin = headers.get("origin")
        if origin is not None and origin not in self._origins and origin.partition("://")[2] != headers.get("host"):
            raise OriginRefused(f"pages of {origin} may not use this service: GRIPWRIGHT_CORS_ORIGINS lists those that may")


def _address(scope: Scope) -> str:
    client = scope.get("client")
    return client[0] if client else ""


class Cors(CORSMiddleware):
    """CORS for listed origins, whose refusals are problems, too."""

    def preflight_response(self, request_headers: Headers) -> Response:
        """The answer to a preflight request."""
        answer = super().preflight_response(request_headers)
        if answer.status_code < 400:
            return answer
        return problem(403, "origin-refused", f"pages of {request_headers['origin']} may not send this request")
