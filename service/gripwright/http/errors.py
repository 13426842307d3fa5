"""Every error as `application/problem+json` (RFC 9457). Domain codes become statuses here and nowhere else."""

import logging
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from types import MappingProxyType
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from sqlalchemy.exc import DataError, IntegrityError, OperationalError
from starlette.exceptions import HTTPException
from starlette.routing import compile_path

from gripwright.domain.errors import Fault, GripwrightError
from gripwright.http.head import STREAM
from gripwright.store.engines import DATABASE_FAILURES, is_full
from gripwright.store.files import FULL_ERRNOS

_log = logging.getLogger(__name__)

_SHOWN_OF_PATH = 200

STATUS_OF_CODE: Mapping[str, int] = {
    "invalid-input": 422,
    "invalid-geometry": 422,
    "invalid-plan": 422,
    "limit-exceeded": 413,
    "not-found": 404,
    "conflict": 409,
    "cancelled": 409,
    "plugin-failure": 500,
    "precondition-failed": 412,
    "precondition-required": 428,
    "unsupported-media-type": 415,
    "not-acceptable": 406,
    "not-authenticated": 401,
    "scope-missing": 403,
    "origin-refused": 403,
    "not-ready": 503,
    "storage-unavailable": 503,
    "storage-refused": 500,
    "insufficient-storage": 507,
    "too-many-requests": 429,
    "busy": 503,
    "request-in-flight": 409,
    "key-reused": 422,
}


MERGE_PATCH_TYPES = ("application/merge-patch+json", "application/json")


class PreconditionFailed(GripwrightError):
    """`If-Match` names another version than the present one."""

    code = "precondition-failed"


class PreconditionRequired(GripwrightError):
    """The change needs `If-Match`."""

    code = "precondition-required"


class UnsupportedMediaType(GripwrightError):
    """The body has a media type that this path does not read."""

    code = "unsupported-media-type"


class NotAcceptable(GripwrightError):
    """`Accept` allows none of the media types on offer."""

    code = "not-acceptable"


class OriginRefused(GripwrightError):
    """A page of another site sent the request, and its origin is not on the list."""

    code = "origin-refused"


class TooManyRequests(GripwrightError):
    """The caller has asked more than it may for now."""

    code = "too-many-requests"

    def __init__(self, detail: str, *, retry_after_s: int, headers: Mapping[str, str] = MappingProxyType({})) -> None:
        super().__init__(detail, retry_after_s=retry_after_s)
        self.headers = headers


class Busy(GripwrightError):
    """As much is worked on as the service can, and nothing ended in time."""

    code = "busy"


class RequestInFlight(GripwrightError):
    """The first request with this `Idempotency-Key` is not answered yet."""

    code = "request-in-flight"


class KeyReused(GripwrightError):
    """The `Idempotency-Key` belongs to another request."""

    code = "key-reused"


class NotReady(GripwrightError):
    """The service cannot work yet, or not any more."""

    code = "not-ready"


def problem(
    status: int, code: str, detail: str, *, faults: Sequence[Fault] = (), headers: Mapping[str, str] | None = None
) -> JSONResponse:
    """A problem document."""
    body: dict[str, Any] = {
        "type": f"urn:gripwright:problem:{code}",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
    }
    if faults:
        body["errors"] = [{"pointer": fault.pointer, "message": fault.message} for fault in faults]
    return JSONResponse(body, status, headers=headers, media_type="application/problem+json")


def register_error_handlers(app: FastAPI) -> None:
    """Let the app answer every error with a problem, the framework's own included."""
    app.add_exception_handler(GripwrightError, domain_problem)
    app.add_exception_handler(RequestValidationError, _validation_problem)
    app.add_exception_handler(HTTPException, _framework_problem)
    app.add_exception_handler(IntegrityError, _integrity_problem)
    app.add_exception_handler(DataError, _data_problem)
    for failure in DATABASE_FAILURES:
        app.add_exception_handler(failure, database_problem)
    app.add_exception_handler(OSError, _system_problem)
    app.add_exception_handler(Exception, _internal_problem)


def domain_problem(request: Request, error: Exception) -> JSONResponse:
    """The problem that a domain error is, with what HTTP wants said beside it."""
    assert isinstance(error, GripwrightError)
    status = STATUS_OF_CODE.get(error.code, 500)
    headers = dict(error.headers) if isinstance(error, TooManyRequests) else {}
    retry_after_s = error.context.get("retry_after_s", 5 if status == 503 else None)
    if retry_after_s is not None:
        headers["Retry-After"] = str(retry_after_s)
    if status == 401:
        refused = "authorization" in request.headers
        headers["WWW-Authenticate"] = 'Bearer realm="gripwright"' + (', error="invalid_token"' if refused else "")
    elif error.code == "scope-missing":
        needed = error.context["scope"]
        headers["WWW-Authenticate"] = f'Bearer realm="gripwright", error="insufficient_scope", scope="{needed}"'
    elif status == 415 and request.method == "PATCH":
        headers["Accept-Patch"] = ", ".join(MERGE_PATCH_TYPES)
    return problem(status, error.code, error.detail, faults=error.faults, headers=headers)


def _validation_problem(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    entries = error.errors()
    content_type = request.headers.get("content-type", "")
    if any(entry["loc"][0] == "body" for entry in entries) and content_type and "json" not in content_type:
        return problem(415, "unsupported-media-type", f"the body must be JSON, it is {content_type}")
    faults = [
        Fault(pointer="" if entry["type"] == "json_invalid" else _pointer(entry["loc"]), message=_message(entry))
        for entry in entries
    ]
    return problem(422, "invalid-input", "the request cannot be used", faults=faults)


def _pointer(location: Sequence[str | int]) -> str:
    """A JSON pointer into the body; for the rest of the request its part stands first, as in /query/limit."""
    steps = location[1:] if location[0] == "body" else location
    return "".join("/" + str(step).replace("~", "~0").replace("/", "~1") for step in steps)


def _message(entry: Mapping[str, Any]) -> str:
    reason = entry.get("ctx", {}).get("error")
    if entry["type"] == "json_invalid":
        return f"{entry['msg']} at character {entry['loc'][-1]}: {reason}"
    return str(entry["msg"])


def _framework_problem(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    if error.status_code == 405 and request.method == "OPTIONS":
        return Response(status_code=204, headers=_options(_methods(request, error)))
    code = "limit-exceeded" if error.status_code == 413 else HTTPStatus(error.status_code).phrase.lower().replace(" ", "-")
    headers = dict(error.headers or {})
    if error.status_code == 405:
        headers["Allow"] = ", ".join(_methods(request, error))
    if error.status_code in (404, 405):
        detail = f"there is no {request.method} {request.url.path[:_SHOWN_OF_PATH]}"
    else:
        detail = str(error.detail)
    return problem(error.status_code, code, detail, headers=headers)


def _options(methods: Sequence[str]) -> dict[str, str]:
    patches = {"Accept-Patch": ", ".join(MERGE_PATCH_TYPES)} if "PATCH" in methods else {}
    return {"Allow": ", ".join(methods), **patches}


def _methods(request: Request, error: HTTPException) -> list[str]:
    """What the path that was asked for allows; the framework names the methods of one of its routes only."""
    named = {word.strip() for word in (error.headers or {}).get("Allow", "").split(",") if word}
    paths, asked = request.app.openapi()["paths"], request.url.path
    for template, operations in paths.items():
        if template == asked or (asked not in paths and compile_path(template)[0].match(asked)):
            named |= {method.upper() for method in operations}
    implied = {"OPTIONS"} | ({"HEAD"} if "GET" in named and not request.url.path.endswith(STREAM) else set())
    return sorted(named | implied)


def _integrity_problem(request: Request, error: Exception) -> JSONResponse:
    return problem(409, "conflict", "another request wrote the same thing at the same time: read again, then repeat")


def _data_problem(request: Request, error: Exception) -> JSONResponse:
    return problem(422, "invalid-input", "the request holds a value that no database stores, such as a NUL character")


def database_problem(request: Request, error: Exception) -> JSONResponse:
    """The problem that a database which does not answer is."""
    if isinstance(error, OperationalError) and is_full(error.orig):
        return problem(507, "insufficient-storage", "no space is left on the database's disk")
    _log.error("the database failed in %s %s", request.method, request.url.path, exc_info=error)
    return problem(503, "not-ready", "the database does not answer in time", headers={"Retry-After": "5"})


def _system_problem(request: Request, error: Exception) -> JSONResponse:
    if isinstance(error, OSError) and error.errno in FULL_ERRNOS:
        _log.error("no space is left in %s %s: %s", request.method, request.url.path, error)
        return problem(507, "insufficient-storage", "no space is left on the service's disk")
    return defect_problem(request, error)


def defect_problem(request: Request, error: Exception) -> JSONResponse:
    """The problem that a defect is: the log tells which, the answer does not."""
    _log.error("defect in %s %s", request.method, request.url.path, exc_info=error)
    return _internal_problem(request, error)


def _internal_problem(request: Request, error: Exception) -> JSONResponse:
    """The same where the server tells the log: of a defect outside of all middleware."""
    return problem(500, "internal", "the service has a defect; its log says where")
