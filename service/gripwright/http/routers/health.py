"""Whether the service lives, whether it can work, and how it fares."""

from typing import Annotated, cast

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4

from gripwright.http.deps import Now, ReadSession, Service
from gripwright.http.errors import NotReady
from gripwright.http.readiness import Readiness
from gripwright.http.schemas.health import Health
from gripwright.http.schemas.problem import problems

router = APIRouter(tags=["health"])


async def checked_readiness(request: Request) -> Readiness:
    """The checks of this service."""
    return cast(Readiness, request.app.state.readiness)


@router.get("/health/live", operation_id="health_live")
def live() -> Health:
    """The process answers."""
    return Health(status="ok")


@router.get("/health/ready", operation_id="health_ready", responses=problems(503))
def ready(readiness: Annotated[Readiness, Depends(checked_readiness)]) -> Health:
    """The database has this version's form and can be written to, files can be stored, plug-ins are listed, workers run."""
    if faults := readiness.faults():
        failed = ", ".join(fault.pointer.removeprefix("/checks/") for fault in faults)
        raise NotReady(f"the service cannot work: {failed}", faults=faults)
    return Health(status="ok")


@router.get("/metrics", operation_id="metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
def metrics(service: Service, session: ReadSession, now: Now) -> Response:
    """Figures for Prometheus."""
    return Response(service.metrics.text(session, service.settings.data_dir, now), media_type=CONTENT_TYPE_PLAIN_0_0_4)
