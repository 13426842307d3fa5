"""Imports of products as callers see them."""

from typing import Literal

from pydantic import BaseModel, Field

from gripwright.cad.package import Product
from gripwright.http.schemas.problem import ProblemError
from gripwright.jobs.product_import import ImportedProduct
from gripwright.store.models import ProductRow


class ImportedProductView(BaseModel):
    """What has become of one package; of a dry run, what would become of it."""

    name: str = Field(description="of the file, after the archive that holds it")
    outcome: Literal["created", "exists", "conflict", "refused"]
    part_number: str | None
    revision: str | None
    product_id: str | None = Field(description="of the product that there is")
    detail: str | None = Field(description="why it was not stored")
    errors: list[ProblemError]

    @classmethod
    def of(cls, product: ImportedProduct) -> "ImportedProductView":
        """The view of one package."""
        return cls(
            name=product.name,
            outcome=product.outcome,
            part_number=product.part_number,
            revision=product.revision,
            product_id=product.product_id,
            detail=product.detail,
            errors=[ProblemError(pointer=fault.pointer, message=fault.message) for fault in product.faults],
        )

    @classmethod
    def checked(cls, name: str, product: Product, existing: ProductRow | None) -> "ImportedProductView":
        """The view of a dry run of one upload."""
        return cls(
            name=name,
            outcome="created" if existing is None else "exists",
            part_number=product.manifest.part_number,
            revision=product.manifest.revision,
            product_id=None if existing is None else existing.id,
            detail=None,
            errors=[],
        )


class ProductImportView(BaseModel):
    """What has become of all packages, in the order in which they came."""

    dry_run: bool
    items: list[ImportedProductView]
