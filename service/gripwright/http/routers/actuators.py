"""The catalogue of actuators."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Request, Response, status

from gripwright.domain.errors import Fault, InvalidInput
from gripwright.http.deps import Now, ReadSession, WriteSession
from gripwright.http.errors import UnsupportedMediaType
from gripwright.http.idempotency import ActingRoute
from gripwright.http.preconditions import ABSENT, IfMatch, check_match
from gripwright.http.reading import NOT_MODIFIED, Sparse
from gripwright.http.schemas.actuators import CSV_SCHEMA, ActuatorFigures, ActuatorImport, ActuatorList, ActuatorView
from gripwright.http.schemas.problem import problems
from gripwright.jobs.catalogue import import_actuators
from gripwright.store.actuators import ActuatorRepository
from gripwright.store.models import ActuatorRow

router = APIRouter(prefix="/actuators", tags=["actuators"], route_class=ActingRoute)

Maker = Annotated[str, Path(min_length=1, max_length=100, pattern=r"^[^/\x00-\x1f]+$")]
Model = Annotated[str, Path(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f]+$", description="may contain /")]


@router.get("", operation_id="list_actuators", response_model=ActuatorList, responses={**NOT_MODIFIED, **problems(422)})
def list_actuators(session: ReadSession, sparse: Sparse) -> Response:
    """The whole catalogue in the order of maker and model."""
    return sparse.answer(ActuatorList(items=[ActuatorView.of(row) for row in ActuatorRepository(session).all()]))


async def csv_text(request: Request) -> str:
    """The body of a request as the text of a CSV."""
    if not request.headers.get("content-type", "").lower().startswith("text/csv"):
        raise UnsupportedMediaType("actuators are imported from text/csv")
    try:
        return (await request.body()).decode()
    except UnicodeDecodeError as error:
        fault = Fault(pointer="", message=f"is not UTF-8: {error.reason} at byte {error.start}")
        raise InvalidInput("the actuators cannot be imported", faults=(fault,)) from None


@router.post("/import", operation_id="import_actuators", responses=problems(413, 415, 422), openapi_extra=dict(CSV_SCHEMA))
def import_catalogue(
    text: Annotated[str, Depends(csv_text)],
    session: WriteSession,
    now: Now,
    dry_run: Annotated[bool, Query(description="say what would be done, and do nothing")] = False,
) -> ActuatorImport:
    """Add the actuators of a CSV, or replace those that are there: all or, where a row cannot be read, none."""
    return ActuatorImport.of(import_actuators(session, text, now, dry_run=dry_run), dry_run=dry_run)


@router.get(
    "/{maker}/{model:path}",
    operation_id="get_actuator",
    response_model=ActuatorView,
    responses={**NOT_MODIFIED, **problems(404, 422)},
)
def get_actuator(maker: Maker, model: Model, session: ReadSession, sparse: Sparse) -> Response:
    """One actuator."""
    row = ActuatorRepository(session).get(maker, model)
    return sparse.answer(ActuatorView.of(row), tag=_tag(row))


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
    check_match(if_match, ABSENT if present is None else _tag(present))
    row, is_new = actuators.put(body.actuator(maker, model), now)
    response.status_code = status.HTTP_201_CREATED if is_new else status.HTTP_200_OK
    response.headers["ETag"] = _tag(row)
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
    check_match(if_match, _tag(row))
    actuators.delete(row)


def _tag(row: ActuatorRow) -> str:
    """The entity tag: with the moment, for one that was deleted and put anew counts from 1 again."""
    return f'"{row.version}-{row.updated_at.timestamp():.6f}"'
