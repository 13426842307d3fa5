"""What another revision of a product does to its grippers."""

from fastapi import APIRouter, Response, status

from gripwright.http.deps import Artifacts, Now, Plugins, Traceparent, WriteSession
from gripwright.http.schemas.change_impact import ImpactRequest, ImpactView
from gripwright.http.schemas.problem import problems
from gripwright.jobs.impact import study_impact

router = APIRouter(tags=["designs"])

POLL_AFTER_S = 1


@router.post(
    "/products/{product_id}/change-impact",
    operation_id="create_change_impact",
    response_model=ImpactView,
    responses={
        202: {"model": ImpactView, "description": "The revision is being designed: ask again"},
        **problems(404, 409, 415, 422),
    },
)
def create_change_impact(
    product_id: str,
    body: ImpactRequest,
    session: WriteSession,
    artifacts: Artifacts,
    plugins: Plugins,
    now: Now,
    traceparent: Traceparent,
    response: Response,
) -> ImpactView:
    """Which operations and grippers of the latest complete design hold with another revision.

    The revision is designed with these grippers as owned: 202 until that has ended, then 200 with the comparison.
    """
    study = study_impact(session, artifacts, plugins, product_id, body.revision, now)
    if study.impact is None:
        study.design.job.traceparent = study.design.job.traceparent or traceparent
        response.status_code = status.HTTP_202_ACCEPTED
        response.headers["Retry-After"] = str(POLL_AFTER_S)
    return ImpactView.of(study)
