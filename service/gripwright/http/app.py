"""The application: routers, errors, limits, and the headers that every answer has."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from starlette.middleware.errors import ServerErrorMiddleware

import gripwright
from gripwright.http.access import Access, Cors
from gripwright.http.addresses import Addresses
from gripwright.http.body_limit import BodyLimit
from gripwright.http.encodings import Encodings
from gripwright.http.errors import defect_problem, register_error_handlers
from gripwright.http.head import Head
from gripwright.http.host_check import HostCheck
from gripwright.http.idempotency import REPLAYED, Idempotent
from gripwright.http.observed import REQUEST_ID, Observed
from gripwright.http.openapi import describe_problems
from gripwright.http.places import Places
from gripwright.http.readiness import Readiness
from gripwright.http.routers import (
    actuators,
    audit,
    change_impact,
    components,
    dashboard,
    designs,
    gripper_sets,
    health,
    jobs,
    plugins,
    products,
    webhooks,
    workers,
)
from gripwright.http.state import State
from gripwright.http.waiting import Waiting
from gripwright.settings import Settings
from gripwright.store.columns import utc_now
from gripwright.store.migrate import prepare

PREFIX = "/api/v1"

_ROUTERS = (
    *(
        (PREFIX, module.router)
        for module in (
            products,
            components,
            designs,
            change_impact,
            jobs,
            gripper_sets,
            plugins,
            actuators,
            webhooks,
            audit,
            workers,
        )
    ),
    ("", health.router),
    ("", dashboard.router),
)

_METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")
_SENT = (
    "Authorization",
    "Content-Type",
    "Idempotency-Key",
    "If-Match",
    "If-None-Match",
    "If-Range",
    "Last-Event-ID",
    "Prefer",
    "Range",
    REQUEST_ID,
)
_SHOWN = (
    "Accept-Patch",
    "Content-Disposition",
    "Content-Range",
    "Deprecation",
    "ETag",
    "Link",
    "Location",
    "Preference-Applied",
    "RateLimit",
    "RateLimit-Policy",
    REPLAYED,
    "Retry-After",
    "Sunset",
    "WWW-Authenticate",
    REQUEST_ID,
)

_DESCRIPTION = (
    "Reads CAD models and an assembly sequence, answers with the smallest set of robot grippers: actuators to buy, "
    "fingers to make, CAD, bill of materials. Lengths in mm, masses in kg, forces in N."
)


def create_app(settings: Settings) -> FastAPI:
    """The service. At its start the default database is migrated; another one must be at this version already."""
    service = State(settings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        settings.data_dir.mkdir(parents=True, exist_ok=True)
        prepare(service.database, automatically=settings.uses_default_database)
        service.start()
        service.audit.clear(utc_now())
        service.answers.clear(utc_now())
        yield
        service.stop()

    app = FastAPI(
        title="Gripwright",
        version=gripwright.__version__,
        description=_DESCRIPTION,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url="/openapi.json",
    )
    app.state.service, app.state.readiness = service, Readiness(service)
    describe_problems(app)
    register_error_handlers(app)
    _add_middleware(app, service)
    for prefix, router in _ROUTERS:
        app.include_router(router, prefix=prefix)
    return app


def _add_middleware(app: FastAPI, service: State) -> None:
    """The innermost first.

    An answer is kept as it was made, and what is given again waits and is encoded as the first time; conditions and lengths are
    those of a GET before its body is dropped for a HEAD; a defect of all these is a problem that is audited and counted.
    """
    settings = service.settings
    app.add_middleware(Idempotent, answers=service.answers)
    app.add_middleware(Waiting, watch=service.ends, wait_max_s=settings.wait_max_s)
    app.add_middleware(
        BodyLimit,
        upload_paths=frozenset({f"{PREFIX}/products", f"{PREFIX}/products/import"}),
        upload_max_bytes=settings.upload_max_bytes,
        body_max_bytes=settings.body_max_bytes,
    )
    app.add_middleware(Addresses)
    app.add_middleware(Encodings)
    app.add_middleware(Head)
    app.add_middleware(ServerErrorMiddleware, handler=defect_problem)  # the framework's own is outside of all that follows
    app.add_middleware(Access, gate=service.gate, audit=service.audit, limits=service.limits, origins=settings.cors_origins)
    if settings.cors_origins:
        app.add_middleware(
            Cors, allow_origins=settings.cors_origins, allow_methods=_METHODS, allow_headers=_SENT, expose_headers=_SHOWN
        )
    if settings.allowed_hosts or not settings.asks_for_access:
        app.add_middleware(HostCheck, allowed=settings.allowed_hosts)
    app.add_middleware(Observed, places=Places(_ROUTERS), metrics=service.metrics, tracer=service.tracer)
