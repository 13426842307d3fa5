"""What steps hand to each other, beside the values of the domain."""

from dataclasses import dataclass

from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement
from gripwright.domain.gripper import Actuator
from gripwright.domain.preference import Preference
from gripwright.domain.shape import Analysis, FloatArray, IntArray, Mesh, Segment


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PreparedShape:
    """A mesh made ready: `mesh` for analysis, `solid` (repaired only, few triangles) for collisions."""

    mesh: Mesh
    solid: Mesh
    file_faces: int
    warnings: tuple[str, ...]
    timings: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segmentation:
    """The segments of a prepared mesh and the labels of the file's faces; `sdf` and `remarks` as in `Analysis`."""

    segmenter: str
    segments: tuple[Segment, ...]
    source_labels: IntArray
    timings: dict[str, float]
    sdf: FloatArray | None
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComponentGrips:
    """What may be gripped of one component before the assembly is considered: for each segment its requirements or why none."""

    forbidden: tuple[Forbidden, ...]
    segments: dict[int, tuple[GripRequirement, ...] | Rejection]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Participant:
    """A component as it takes part in an operation (the component's own mesh is left out)."""

    component: Component
    prepared: PreparedShape
    analysis: Analysis | None = None
    grips: ComponentGrips | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HouseActuators:
    """The actuators that the house allows, why it refuses the others, and what it prefers."""

    allowed: tuple[Actuator, ...]
    refused: tuple[tuple[Actuator, Rejection], ...]
    preferences: dict[str, tuple[Preference, ...]]  # by the actuator's name
