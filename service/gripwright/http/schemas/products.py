"""Products and components as callers see them. Names and units as in product.json: mm, kg/m³."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from gripwright.cad.manifest import ComponentEntry, ObstacleEntry, OperationEntry, RegionEntry
from gripwright.domain.assembly import Texture
from gripwright.store.models import ComponentRow, ProductRow


class BoundsView(BaseModel):
    """Axis-aligned bounds in the component's frame, mm."""

    min: list[float]
    max: list[float]


class ComponentView(BaseModel):
    """A component: its entry of the manifest, and what was measured of its mesh."""

    id: str
    part_number: str
    revision: str
    name: str
    file: str
    units: str | None
    pose: list[list[float]] = Field(description="4×4 row-major, places the component's frame in the product")
    density: float
    friction: float
    texture: Texture | None
    ferrous: bool | None
    no_grasp: list[RegionEntry]
    may_grasp: list[RegionEntry]
    external_ids: dict[str, str]
    faces: int
    bounds: BoundsView
    mesh: str = Field(description="path of its mesh as GLB")

    @classmethod
    def of(cls, product: ProductRow, row: ComponentRow) -> "ComponentView":
        """The view of a component."""
        entry = ComponentEntry.model_validate(product.manifest["components"][row.position])
        return cls(
            **entry.model_dump(exclude={"note", "pose"}),
            pose=[list(line) for line in entry.pose],
            faces=row.faces,
            bounds=BoundsView(min=row.bounds_min_mm, max=row.bounds_max_mm),
            mesh=f"/api/v1/products/{product.id}/components/{row.id}/mesh.glb",
        )


class ProductSummary(BaseModel):
    """A product in a list."""

    id: str
    part_number: str
    revision: str
    name: str
    external_ids: dict[str, str]
    components: int
    operations: int
    version: int = Field(description="counts changes; the ETag")
    created_at: datetime
    updated_at: datetime

    @classmethod
    def of(cls, row: ProductRow) -> "ProductSummary":
        """The summary of a product."""
        return cls(
            id=row.id,
            part_number=row.part_number,
            revision=row.revision,
            name=row.name,
            external_ids={one.system: one.value for one in sorted(row.external_ids, key=lambda one: one.system)},
            components=row.component_count,
            operations=row.operation_count,
            version=row.version,
            created_at=row.created_at,
            updated_at=row.updated_at,
        )


class ProductPage(BaseModel):
    """A page of products."""

    items: list[ProductSummary]
    next_cursor: str | None
    next_updated_since: datetime | None = Field(
        description="of a first page: the `updated_since` that misses nothing the next time; what changed last may come twice"
    )


class ComponentList(BaseModel):
    """All components of a product, in the order of its manifest."""

    items: list[ComponentView]


class ProductView(BaseModel):
    """A product with its components and its assembly sequence."""

    id: str
    part_number: str
    revision: str
    name: str
    external_ids: dict[str, str]
    components: list[ComponentView]
    environment: list[ObstacleEntry]
    operations: list[OperationEntry]
    warnings: list[str]
    version: int = Field(description="counts changes; the ETag")
    created_at: datetime
    updated_at: datetime

    @classmethod
    def of(cls, row: ProductRow) -> "ProductView":
        """The view of a product."""
        return cls(
            id=row.id,
            part_number=row.part_number,
            revision=row.revision,
            name=row.name,
            external_ids=external_ids_of(row),
            components=[ComponentView.of(row, component) for component in row.components],
            environment=row.manifest["environment"],
            operations=row.manifest["operations"],
            warnings=row.warnings,
            version=row.version,
            created_at=row.created_at,
            updated_at=row.updated_at,
        )


class ComponentPatch(BaseModel):
    """A merge patch (RFC 7396) of a component; null restores the default. Only for the documentation: see jobs/products.py."""

    model_config = ConfigDict(extra="forbid")

    no_grasp: list[RegionEntry] | None = None
    may_grasp: list[RegionEntry] | None = None
    density: float | None = Field(default=None, gt=0, le=25_000, description="kg/m³")
    friction: float | None = Field(default=None, gt=0, le=5)
    texture: Texture | None = Field(default=None, description="how tight the surface is against a suction cup's lip")
    ferrous: bool | None = Field(default=None, description="whether a magnet holds it")
    external_ids: dict[str, str | None] | None = Field(default=None, description="merged: null takes the id of a system away")


class ProductPatch(BaseModel):
    """A merge patch (RFC 7396) of a product; null restores the default. Only for the documentation: see jobs/products.py."""

    model_config = ConfigDict(extra="forbid")

    name: str | None = Field(default=None, max_length=500)
    external_ids: dict[str, str | None] | None = Field(default=None, description="merged: null takes the id of a system away")


def product_reference(row: ProductRow) -> dict[str, Any]:
    """What a product is called, as it stands now."""
    return {
        "id": row.id,
        "part_number": row.part_number,
        "revision": row.revision,
        "name": row.name,
        "external_ids": external_ids_of(row),
    }


def external_ids_of(row: ProductRow) -> dict[str, str]:
    """What other systems call the product; one stored before there were such ids has none."""
    ids: dict[str, str] = row.manifest.get("external_ids", {})
    return ids


OperationsBody = dict[str, Any] | list[Any]
"""`{"operations": […]}`, or the list alone, as in product.json."""
