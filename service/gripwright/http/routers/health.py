"""Whether the service lives, whether it can work, and how it fares."""

import logging

from fastapi import APIRouter, Response
from sqlalchemy.exc import SQLAlchemyError

from gripwright.domain.errors import GripwrightError
from gripwright.http.deps import Now, ReadSession, Service
from gripwright.http.errors import NotReady
from gripwright.http.metrics import metrics_text
from gripwright.http.schemas.health import Health
from gripwright.http.schemas.problem import problems
from gripwright.store.migrate import require_current

router = APIRouter(tags=["health"])
_log = logging.getLogger(__name__)


@router.get("/health/live", operation_id="health_live")
def live() -> Health:
    """The process answers."""
    return Health(status="ok")


@router.get("/health/ready", operation_id="health_ready", responses=problems(503))
def ready(service: Service) -> Health:
    """The database is there in this version's form, files can be written, and the plug-ins are listed."""
    try:
        require_current(service.database)
        service.artifacts.files.refresh("ready", b"ready")  # of no quota: what is full can be read still
    except GripwrightError as error:
        raise NotReady(f"the store cannot be used: {error.detail}") from error
    except (SQLAlchemyError, OSError) as error:
        _log.exception("the store cannot be used")
        raise NotReady("the store cannot be used; the service's log says why") from error
    if service.plugins is None:
        raise NotReady(service.plugins_problem or "the plug-ins are still being listed")
    return Health(status="ok")


@router.get("/metrics", operation_id="metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
def metrics(service: Service, session: ReadSession, now: Now) -> Response:
    """Figures for Prometheus."""
    return Response(metrics_text(session, service.requests, now), media_type="text/plain; version=0.0.4; charset=utf-8")
