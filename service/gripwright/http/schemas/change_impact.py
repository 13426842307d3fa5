"""The impact of a change as callers see it."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from gripwright.http.schemas.designs import status_of
from gripwright.jobs.impact import ImpactStudy


class ImpactRequest(BaseModel):
    """Which revision to judge."""

    model_config = ConfigDict(extra="forbid")

    revision: str = Field(min_length=1, max_length=200, description="id of the product that is the other revision")


class OperationImpact(BaseModel):
    """One operation: whether the gripper that did it before does it still. Grippers by name; new ones by their id."""

    id: str
    outcome: Literal["held", "other_gripper", "not_held", "added", "removed"]
    before: str | None
    after: str | None
    detail: str | None = Field(description="why nothing holds it")


class GripperImpact(BaseModel):
    """One gripper of the earlier design."""

    id: str
    name: str
    holds: list[str] = Field(description="its operations that it does still")
    no_longer_holds: list[str]


class ComponentImpact(BaseModel):
    """Whether a component's segments are what they were."""

    id: str
    outcome: Literal["unchanged", "changed", "added", "removed"]
    segments: list[int] = Field(description="of the earlier revision, that have no equal in the new one")


class Impact(BaseModel):
    """The comparison."""

    operations: list[OperationImpact]
    grippers: list[GripperImpact]
    new_grippers: list[str] = Field(description="of the revision's design, that have to be made")
    components: list[ComponentImpact]


class ImpactView(BaseModel):
    """Where the comparison stands, and what it says once the revision is designed."""

    earlier_design: str = Field(description="path of the design that is judged")
    design: str = Field(description="path of the revision's design, with these grippers as owned")
    status: str = Field(description="of the revision's design: queued, running, complete, incomplete")
    impact: Impact | None

    @classmethod
    def of(cls, study: ImpactStudy) -> "ImpactView":
        """The view of a study."""
        return cls(
            earlier_design=f"/api/v1/designs/{study.earlier.id}",
            design=f"/api/v1/designs/{study.design.id}",
            status=status_of(study.design),
            impact=None if study.impact is None else Impact.model_validate(study.impact),
        )
