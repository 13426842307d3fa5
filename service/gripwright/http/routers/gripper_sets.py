"""The gripper-set optimisation alone."""

from typing import Annotated, Any

from fastapi import APIRouter, Body

from gripwright.http.deps import HeavyTurn, Service
from gripwright.http.idempotency import ActingRoute
from gripwright.http.schemas.problem import problems
from gripwright.jobs.gripper_sets import solve_document

router = APIRouter(prefix="/gripper-sets", tags=["gripper sets"], route_class=ActingRoute)


@router.post("", operation_id="minimise_gripper_set", responses=problems(413, 415, 422, 503))
def minimise_gripper_set(body: Annotated[dict[str, Any], Body()], turn: HeavyTurn, service: Service) -> dict[str, Any]:
    """The smallest set of grippers that holds every component, as `gripwright minimise` gives it."""
    return solve_document(body, timeout_s=service.settings.gripper_set_timeout_s)
