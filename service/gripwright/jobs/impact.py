"""What another revision of a product does to the grippers of its latest complete design."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from gripwright.design.impact import change_impact
from gripwright.design.owned import specifications
from gripwright.domain.errors import Conflict, Fault, InvalidInput
from gripwright.jobs.requests import request_design
from gripwright.registry.description import RegistryDescription
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.designs import USUAL_TERMS, DesignRepository, JobTerms
from gripwright.store.jobs import DOCUMENT
from gripwright.store.models import DesignRow
from gripwright.store.products import ProductRepository


@dataclass(frozen=True, slots=True, kw_only=True)
class ImpactStudy:
    """The design that is judged, the revision's design with its grippers, and their comparison once that one has ended."""

    earlier: DesignRow
    design: DesignRow
    impact: dict[str, Any] | None


def study_impact(
    session: Session,
    artifacts: ArtifactStore,
    description: RegistryDescription,
    product_id: str,
    revision_id: str,
    now: datetime,
    terms: JobTerms = USUAL_TERMS,
) -> ImpactStudy:
    """The comparison, or the queued design of the revision that it needs. What was asked before is not designed again."""
    designs, products = DesignRepository(session), ProductRepository(session)
    product = products.get(product_id)
    if revision_id == product_id:
        fault = Fault(pointer="/revision", message="is the product itself")
        raise InvalidInput("a product is no revision of itself", faults=(fault,))
    revision = products.get(revision_id)
    earlier = designs.latest_complete(product.id)
    if earlier is None:
        raise Conflict("no design of this product is complete: request one, then ask again", product_id=product.id)
    before = _document(designs, artifacts, earlier)
    options = {**earlier.options, "owned": _at_hand(before, earlier.options)}
    design = designs.find_like(revision.id, revision.task_sha256, options)
    if design is None:
        design = request_design(session, artifacts, description, revision.id, options, now, terms)
    if design.job.status in ("failed", "cancelled"):
        raise Conflict(f"the design of the revision has {design.job.status}: retry its job, then ask again", job_id=design.id)
    impact = None if design.outcome is None else change_impact(before, _document(designs, artifacts, design))
    return ImpactStudy(earlier=earlier, design=design, impact=impact)


def _at_hand(document: Mapping[str, Any], options: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The grippers of a design, and those that it was given and did not use."""
    used = specifications(document)
    names = {gripper["name"] for gripper in used}
    return used + [gripper for gripper in options.get("owned", []) if gripper["name"] not in names]


def _document(designs: DesignRepository, artifacts: ArtifactStore, design: DesignRow) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(artifacts.get(designs.file(design.id, DOCUMENT).sha256))
    return document
