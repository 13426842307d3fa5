"""Actuators as callers see them: mm, N, kg."""

from collections.abc import Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from gripwright.design.catalogue import why_not
from gripwright.domain.gripper import Actuator
from gripwright.http.schemas.problem import ProblemError
from gripwright.jobs.catalogue import CatalogueImport
from gripwright.store.actuators import actuator_of
from gripwright.store.models import ActuatorRow

_Text = Annotated[str, Field(pattern=r"^[^\x00]*$")]  # PostgreSQL stores no NUL


class ActuatorFigures(BaseModel):
    """The maker's figures of an actuator; null where they are not known."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True)

    gripper_type: _Text = Field(min_length=1, max_length=50, examples=["parallel-2", "centric-3"])
    stroke: float = Field(
        ge=0,
        le=5000,
        description="mm, total change of the opening width (of the diameter for centric ones); 0: not known, or none",
    )
    opening_max: float | None = Field(
        default=None, gt=0, le=5000, description="mm, distance of the jaws' references, fully open; without jaws the largest face"
    )
    grip_force: float | None = Field(
        default=None, gt=0, description="N, the sum over the jaws; without jaws what the largest face holds"
    )
    mass: float | None = Field(default=None, gt=0, description="kg")
    finger_length_max: float | None = Field(default=None, gt=0, description="mm")
    finger_mass_max: float | None = Field(default=None, gt=0, description="kg, of one finger")
    body_diameter: float | None = Field(default=None, gt=0, description="mm")
    body_length: float | None = Field(default=None, gt=0, description="mm")
    price: float | None = Field(default=None, ge=0)
    stroke_basis: _Text = Field(
        default="total", max_length=20, description="as the maker states it: total, diameter, per-jaw; none: it has no jaws"
    )
    force_basis: _Text = Field(default="unknown", max_length=20, description="as the maker states it: total, per-jaw, unknown")
    confidence: Literal["A", "B", "C"] = Field(
        default="B",
        description="A: the maker's own document; B: second hand; C: sources conflict, used only where a plan names it",
    )
    source: _Text = Field(default="", max_length=2000)
    note: _Text = Field(default="", max_length=2000)

    def actuator(self, maker: str, model: str) -> Actuator:
        """The domain value."""
        return Actuator(
            maker=maker,
            model=model,
            gripper_type=self.gripper_type,
            stroke_mm=self.stroke,
            opening_max_mm=self.opening_max,
            grip_force_N=self.grip_force,
            mass_kg=self.mass,
            finger_length_max_mm=self.finger_length_max,
            finger_mass_max_kg=self.finger_mass_max,
            body_diameter_mm=self.body_diameter,
            body_length_mm=self.body_length,
            price=self.price,
            stroke_basis=self.stroke_basis,
            force_basis=self.force_basis,
            confidence=self.confidence,
            source=self.source,
            note=self.note,
        )


class ActuatorView(BaseModel):
    """An actuator of the catalogue."""

    maker: str
    model: str
    gripper_type: str
    stroke: float | None = Field(description="mm, total change of the opening width; null: not known")
    opening_max: float | None
    grip_force: float | None
    mass: float | None
    finger_length_max: float | None
    finger_mass_max: float | None
    body_diameter: float | None
    body_length: float | None
    price: float | None
    stroke_basis: str
    force_basis: str
    confidence: str
    source: str
    note: str
    not_used: str | None = Field(description="why a plan uses it only where it is named, or not at all; null: it may be chosen")
    updated_at: datetime

    @classmethod
    def of(cls, row: ActuatorRow) -> "ActuatorView":
        """The view of an actuator."""
        reason = why_not(actuator_of(row))
        return cls(
            maker=row.maker,
            model=row.model,
            gripper_type=row.gripper_type,
            stroke=row.stroke_mm or None,
            opening_max=row.opening_max_mm,
            grip_force=row.grip_force_N,
            mass=row.mass_kg,
            finger_length_max=row.finger_length_max_mm,
            finger_mass_max=row.finger_mass_max_kg,
            body_diameter=row.body_diameter_mm,
            body_length=row.body_length_mm,
            price=row.price,
            stroke_basis=row.stroke_basis,
            force_basis=row.force_basis,
            confidence=row.confidence,
            source=row.source,
            note=row.note,
            not_used=None if reason is None else reason.detail,
            updated_at=row.updated_at,
        )


class ActuatorList(BaseModel):
    """The whole catalogue."""

    items: list[ActuatorView]


CSV_SCHEMA: Mapping[str, Any] = MappingProxyType(
    {
        "requestBody": {
            "required": True,
            "content": {
                "text/csv": {
                    "schema": {"type": "string"},
                    "example": "maker,model,type,fingers,stroke_mm,stroke_basis,grip_force_N,force_basis\n"
                    "Acme,C-10,centric,3,5,per-jaw,40,per jaw\n",
                }
            },
        }
    }
)


class ImportedActuator(BaseModel):
    """An actuator of the file, its figures as totals, and what the import does with it."""

    maker: str
    model: str
    gripper_type: str
    stroke: float | None = Field(description="mm, total change of the opening width; null: not known")
    grip_force: float | None = Field(description="N, the sum over the jaws")
    confidence: str
    note: str
    outcome: Literal["added", "replaced", "unchanged"]


class ActuatorImport(BaseModel):
    """What an import does."""

    dry_run: bool
    items: list[ImportedActuator]
    errors: list[ProblemError] = Field(description="rows that cannot be read; only of a dry run, else the import is refused")

    @classmethod
    def of(cls, done: CatalogueImport, *, dry_run: bool) -> "ActuatorImport":
        """The view of an import."""
        items = [
            ImportedActuator(
                maker=actuator.maker,
                model=actuator.model,
                gripper_type=actuator.gripper_type,
                stroke=actuator.stroke_mm or None,
                grip_force=actuator.grip_force_N,
                confidence=actuator.confidence,
                note=actuator.note,
                outcome=outcome,
            )
            for actuator, outcome in done.actuators
        ]
        errors = [ProblemError(pointer=fault.pointer, message=fault.message) for fault in done.faults]
        return cls(dry_run=dry_run, items=items, errors=errors)
