"""Products and the catalogue that their designs choose from."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    ForeignKey,
    Index,
    String,
    Text,
    UniqueConstraint,
)
from sqlalchemy.orm import Mapped, mapped_column, query_expression, relationship

from gripwright.store.models.base import ID, SHA256, Base


class ProductRow(Base):
    """A product: its manifest (product.json) and the assembly task read from its files."""

    __tablename__ = "product"
    __table_args__ = (
        UniqueConstraint("part_number", "revision"),
        Index(None, "created_at", "id"),
        Index(None, "updated_at", "id"),
    )

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    part_number: Mapped[str] = mapped_column(String(500))
    revision: Mapped[str] = mapped_column(String(500))
    name: Mapped[str] = mapped_column(Text)
    content_sha256: Mapped[str] = mapped_column(SHA256)  # of the task as uploaded: the identity of the content
    task_sha256: Mapped[str] = mapped_column(SHA256)  # artifact: the task as it is now, a record
    # Read where they are used: jobs and designs only want to name their product.
    manifest: Mapped[dict[str, Any]] = mapped_column(deferred=True, deferred_group="content")  # product.json as it is now
    warnings: Mapped[list[Any]] = mapped_column(deferred=True, deferred_group="content")
    version: Mapped[int]  # counts changes; the ETag
    created_at: Mapped[datetime]
    updated_at: Mapped[datetime]

    components: Mapped[list["ComponentRow"]] = relationship(
        order_by="ComponentRow.position", cascade="all, delete-orphan", passive_deletes=True
    )
    external_ids: Mapped[list["ExternalIdRow"]] = relationship(cascade="all, delete-orphan", passive_deletes=True)
    # Where a query asks for them: lists do, and read no manifests.
    component_count: Mapped[int] = query_expression()
    operation_count: Mapped[int] = query_expression()


class ExternalIdRow(Base):
    """What another system calls a product. The manifest holds it, too; this table is to search by."""

    __tablename__ = "external_id"
    __table_args__ = (Index(None, "system", "value"),)

    product_id: Mapped[str] = mapped_column(ID, ForeignKey("product.id", ondelete="CASCADE"), primary_key=True)
    system: Mapped[str] = mapped_column(String(64), primary_key=True)
    value: Mapped[str] = mapped_column(String(200))  # of several products, where they are revisions of one item


class ComponentRow(Base):
    """A component of a product: what was measured of its mesh. The rest is in the manifest."""

    __tablename__ = "component"
    __table_args__ = (UniqueConstraint("product_id", "position"),)

    product_id: Mapped[str] = mapped_column(ID, ForeignKey("product.id", ondelete="CASCADE"), primary_key=True)
    id: Mapped[str] = mapped_column(String(200), primary_key=True)
    position: Mapped[int]
    glb_sha256: Mapped[str] = mapped_column(SHA256)  # artifact: its mesh as GLB
    faces: Mapped[int]
    bounds_min_mm: Mapped[list[Any]]  # (3,) component frame
    bounds_max_mm: Mapped[list[Any]]


class ActuatorRow(Base):
    """An actuator of the catalogue; the columns are the fields of `domain.gripper.Actuator`."""

    __tablename__ = "actuator"

    maker: Mapped[str] = mapped_column(String(100), primary_key=True)
    model: Mapped[str] = mapped_column(String(200), primary_key=True)
    gripper_type: Mapped[str] = mapped_column(String(50))
    stroke_mm: Mapped[float]
    opening_max_mm: Mapped[float | None]
    grip_force_N: Mapped[float | None]
    mass_kg: Mapped[float | None]
    finger_length_max_mm: Mapped[float | None]
    finger_mass_max_kg: Mapped[float | None]
    body_diameter_mm: Mapped[float | None]
    body_length_mm: Mapped[float | None]
    price: Mapped[float | None]
    stroke_basis: Mapped[str] = mapped_column(String(20))
    force_basis: Mapped[str] = mapped_column(String(20))
    confidence: Mapped[str] = mapped_column(String(20))
    source: Mapped[str] = mapped_column(Text)
    note: Mapped[str] = mapped_column(Text)
    version: Mapped[int]
    updated_at: Mapped[datetime]
