"""The gripper-set problem: Eq. (1) and (2) of the paper with closed intervals.

`gripper_type` is opaque here: designs use one class per actuator and palm envelope, each with its own stroke.
"""

from dataclasses import dataclass, field

from gripwright.domain.grasp import EXTERNAL, GraspConstraint
from gripwright.domain.gripper import GripperParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperClass:
    """A kind of gripper that can be bought: its stroke and limits."""

    stroke_mm: float
    grip: str = EXTERNAL
    opening_floor_mm: float = 0.0  # the fingers meet below
    finger_length_max_mm: float = float("inf")
    cost: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentAlternatives:
    """Everything that could hold one component; one of them has to."""

    id: str
    alternatives: tuple[GraspConstraint, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperSetProblem:
    """Components, in the order of the assembly sequence, and the classes of grippers at hand.

    `owned` grippers cost nothing and count nothing; they are used before new ones. With `in_sequence` the least cost, then
    the fewest changes of gripper from one component to the next come before the shortest fingers.
    """

    classes: dict[str, GripperClass]
    components: tuple[ComponentAlternatives, ...]
    release_clearance_mm: float = 0.0
    finger_length_step_mm: float = 0.0  # 0: lengths stay as they are
    owned: tuple[GripperParameters, ...] = ()
    in_sequence: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenGripper:
    """A gripper of the solution and the indices of the alternatives it holds: component id → alternative indices."""

    parameters: GripperParameters
    holds: dict[str, tuple[int, ...]]
    owned: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperSet:
    """A solution of Eq. (1)."""

    grippers: tuple[ChosenGripper, ...]
    lower_bound: int
    proven: bool
    candidates: int
    uncoverable: tuple[str, ...] = ()
    detail: dict[str, str] = field(default_factory=dict)  # objective → "proven" or its gap
