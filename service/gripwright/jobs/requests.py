"""Requests for designs: the snapshot of what is designed and with what, queued in the caller's transaction."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from gripwright.design.catalogue import select
from gripwright.design.owned import actuators_of
from gripwright.design.records import dumps
from gripwright.domain.errors import Conflict, Fault, InvalidInput
from gripwright.registry.description import RegistryDescription, check_options
from gripwright.store.actuators import ActuatorRepository, actuator_of
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.columns import new_id
from gripwright.store.designs import USUAL_TERMS, DesignRepository, JobTerms
from gripwright.store.models import DesignRow, ProductRow
from gripwright.store.products import ProductRepository


def request_design(
    session: Session,
    artifacts: ArtifactStore,
    description: RegistryDescription,
    product_id: str,
    options: Mapping[str, Any],
    now: datetime,
    terms: JobTerms = USUAL_TERMS,
) -> DesignRow:
    """Queue a design of a product. The options are checked against what is installed and against the catalogue."""
    product = ProductRepository(session).get(product_id)
    if not product.manifest["operations"]:
        fault = Fault(pointer="/operations", message="the product has no assembly sequence: PUT its operations first")
        raise InvalidInput("the product has no operations", faults=(fault,))
    catalogue = tuple(actuator_of(row) for row in ActuatorRepository(session).all())
    artifacts.require_room()
    plan = check_options(options, description)
    select(catalogue, plan.actuators)
    actuators_of(plan.owned, catalogue)
    design = DesignRow(
        id=new_id(now),
        product_id=product.id,
        product_version=product.version,
        task_sha256=product.task_sha256,
        actuators_sha256=artifacts.put(dumps(catalogue)),
        options=dict(options),
        outcome=None,
        created_at=now,
    )
    DesignRepository(session).add(design, now, terms)
    return design


def delete_product(session: Session, product: ProductRow) -> None:
    """Delete a product with its designs; Conflict while one of them is queued or running."""
    products = ProductRepository(session)
    if products.has_unfinished_design(product.id):
        raise Conflict("a design of this product is queued or running: cancel it first", product_id=product.id)
    products.delete(product)
