"""All SQL about products and their components."""

from datetime import datetime

from sqlalchemy import func, select, tuple_
from sqlalchemy.orm import Session, selectinload, with_expression

from gripwright.domain.errors import NotFound
from gripwright.store.models import ComponentRow, DesignRow, ExternalIdRow, JobRow, ProductRow
from gripwright.store.pages import Cursor


class ProductRepository:
    """Products. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, row: ProductRow) -> None:
        """Add a product; the write transaction's lock, or the unique constraint, keeps its identity single."""
        self._session.add(row)
        self._session.flush()

    def get(self, product_id: str) -> ProductRow:
        """The product, or `NotFound`."""
        row = self._session.get(ProductRow, product_id)
        if row is None:
            raise NotFound(f"no product {product_id}", product_id=product_id)
        return row

    def find(self, part_number: str, revision: str) -> ProductRow | None:
        """The product of that part number and revision."""
        query = select(ProductRow).where(ProductRow.part_number == part_number, ProductRow.revision == revision)
        return self._session.scalar(query)

    def component(self, product_id: str, component_id: str) -> tuple[ProductRow, ComponentRow]:
        """A component with its product, or `NotFound`."""
        product = self.get(product_id)
        for row in product.components:
            if row.id == component_id:
                return product, row
        raise NotFound(f"product {product_id} has no component {component_id}", product_id=product_id, component_id=component_id)

    def page(
        self,
        *,
        after: Cursor | None,
        limit: int,
        part_number: str | None = None,
        revision: str | None = None,
        external_id: tuple[str, str] | None = None,
        updated_since: datetime | None = None,
    ) -> list[ProductRow]:
        """Up to `limit` products strictly after the cursor, in order of creation, or with `updated_since` of change."""
        moment = ProductRow.created_at if updated_since is None else ProductRow.updated_at
        components = select(func.count()).where(ComponentRow.product_id == ProductRow.id).correlate(ProductRow).scalar_subquery()
        seen = (
            selectinload(ProductRow.external_ids),
            with_expression(ProductRow.component_count, components),
            with_expression(ProductRow.operation_count, func.json_array_length(ProductRow.manifest["operations"])),
        )
        query = select(ProductRow).options(*seen).order_by(moment, ProductRow.id).limit(limit)
        if part_number is not None:
            query = query.where(ProductRow.part_number == part_number)
        if revision is not None:
            query = query.where(ProductRow.revision == revision)
        if external_id is not None:
            named = select(ExternalIdRow.product_id).where(
                ExternalIdRow.system == external_id[0], ExternalIdRow.value == external_id[1]
            )
            query = query.where(ProductRow.id.in_(named))
        if updated_since is not None:
            query = query.where(ProductRow.updated_at >= updated_since)
        if after is not None:
            query = query.where(tuple_(moment, ProductRow.id) > (after.created_at, after.id))
        return list(self._session.scalars(query))

    def changed(self, row: ProductRow, now: datetime) -> None:
        """Count a change: the entity tag is another from now on."""
        row.version += 1
        row.updated_at = now
        self._session.flush()

    def has_unfinished_design(self, product_id: str) -> bool:
        """Whether a design of this product is queued or running."""
        query = (
            select(JobRow.id)
            .join(DesignRow, DesignRow.id == JobRow.id)
            .where(DesignRow.product_id == product_id, JobRow.status.in_(("queued", "running")))
        )
        return self._session.scalar(query.limit(1)) is not None

    def delete(self, row: ProductRow) -> None:
        """Delete a product with its components and designs."""
        self._session.delete(row)
        self._session.flush()
