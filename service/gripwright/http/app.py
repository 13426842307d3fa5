"""The application: routers, errors, limits, and the headers that every answer has."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import APIRouter, FastAPI

import gripwright
from gripwright.http.body_limit import BodyLimit
from gripwright.http.errors import register_error_handlers
from gripwright.http.observed import Observed
from gripwright.http.openapi import describe_problems
from gripwright.http.routers import (
    actuators,
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
)
from gripwright.http.state import State
from gripwright.settings import Settings
from gripwright.store.migrate import prepare

PREFIX = "/api/v1"

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
    app.state.service = service
    describe_problems(app)
    register_error_handlers(app)
    app.add_middleware(Observed, requests=service.requests)
    app.add_middleware(
        BodyLimit,
        upload_path=f"{PREFIX}/products",
        upload_max_bytes=settings.upload_max_bytes,
        body_max_bytes=settings.body_max_bytes,
    )
    api = APIRouter(prefix=PREFIX)
    for module in (products, components, designs, change_impact, jobs, gripper_sets, plugins, actuators, webhooks):
        api.include_router(module.router)
    app.include_router(api)
    app.include_router(health.router)
    app.include_router(dashboard.router)
    return app
