"""The catalogue of actuators."""

from typing import Annotated

from fastapi import APIRouter, Path, Response, status

from gripwright.http.deps import Now, ReadSession, WriteSession
from gripwright.http.preconditions import ABSENT, IfMatch, check_match, version_tag
from gripwright.http.schemas.actuators import ActuatorFigures, ActuatorList, ActuatorView
from gripwright.http.schemas.problem import problems
from gripwright.store.actuators import ActuatorRepository

router = APIRouter(prefix="/actuators", tags=["actuators"])

Maker = Annotated[str, Path(min_length=1, max_length=100, pattern=r"^[^/\x00-\x1f]+$")]
Model = Annotated[str, Path(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f]+$", description="may contain /")]


@router.get("", operation_id="list_actuators")
def list_actuators(session: ReadSession) -> ActuatorList:
    """The whole catalogue in the order of maker and model."""
    return ActuatorList(items=[ActuatorView.of(row) for row in ActuatorRepository(session).all()])


@router.get("/{maker}/{model:path}", operation_id="get_actuator", responses=problems(404))
def get_actuator(maker: Maker, model: Model, session: ReadSession, response: Response) -> ActuatorView:
    """One actuator."""
    row = ActuatorRepository(session).get(maker, model)
    response.headers["ETag"] = version_tag(row.version)
    return ActuatorView.of(row)


@router.put(
    "/{maker}/{model:path}",
    operation_id="put_actuator",
    responses={201: {"model": ActuatorView, "description": "New"}, **problems(412, 422)},
)
def put_actuator(
    maker: Maker,
    model: Model,
    body: ActuatorFigures,
    session: WriteSession,
    now: Now,
    response: Response,
    if_match: IfMatch = None,
) -> ActuatorView:
    """Add an actuator, or replace its figures. Designs keep the catalogue as it stood when they were requested."""
    actuators = ActuatorRepository(session)
    present = actuators.find(maker, model)
    check_match(if_match, ABSENT if present is None else version_tag(present.version))
    row, is_new = actuators.put(body.actuator(maker, model), now)
    response.status_code = status.HTTP_201_CREATED if is_new else status.HTTP_200_OK
    response.headers["ETag"] = version_tag(row.version)
    return ActuatorView.of(row)


@router.delete(
    "/{maker}/{model:path}",
    operation_id="delete_actuator",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=problems(404, 412),
)
def delete_actuator(maker: Maker, model: Model, session: WriteSession, if_match: IfMatch = None) -> None:
    """Take an actuator out of the catalogue."""
    actuators = ActuatorRepository(session)
    row = actuators.get(maker, model)
    check_match(if_match, version_tag(row.version))
    actuators.delete(row)
