"""What another revision of a product does to its grippers."""

from fastapi import APIRouter, Response, status

from gripwright.http.deps import Actor, Artifacts, Now, Plugins, Service, Traceparent, WriteSession
from gripwright.http.idempotency import ActingRoute
from gripwright.http.polling import poll_headers
from gripwright.http.schemas.change_impact import ImpactRequest, ImpactView
from gripwright.http.schemas.problem import problems
from gripwright.jobs.impact import study_impact
from gripwright.store.designs import JobTerms

router = APIRouter(tags=["designs"], route_class=ActingRoute)


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
    actor: Actor,
    service: Service,
    traceparent: Traceparent,
    response: Response,
) -> ImpactView:
    """Which operations and grippers of the latest complete design hold with another revision.

    The revision is designed with these grippers as owned: 202 until that has ended, then 200 with the comparison.
    """
    terms = JobTerms(client=actor, deadline_s=service.settings.design_deadline_s)
    study = study_impact(session, artifacts, plugins, product_id, body.revision, now, terms)
    if study.impact is None:
        study.design.job.traceparent = study.design.job.traceparent or traceparent
        response.status_code = status.HTTP_202_ACCEPTED
        response.headers.update(poll_headers(study.design.job, location=f"/api/v1/designs/{study.design.id}"))
    return ImpactView.of(study)
