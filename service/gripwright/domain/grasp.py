"""Grip requirements, grasps and grasp constraints. Gripper frame G: origin at the fingertips' level, +z approach, +x finger 1."""

import math
from dataclasses import dataclass, field
from typing import Any

from gripwright.domain.errors import Rejection
from gripwright.domain.later import LATER
from gripwright.domain.preference import Preference
from gripwright.domain.shape import FloatArray, Primitive
from gripwright.domain.v_tip import Vee

PARALLEL_2 = "parallel-2"
CENTRIC_3 = "centric-3"
CENTRIC_4 = "centric-4"
EXTERNAL = "external"
INTERNAL = "internal"
SURFACE = "surface"
"""A grip by one face of the component, as of a suction cup or a magnet: the hand does not close, the opening width is the
size of what holds."""


def letting_go(grip: str) -> float:
    """Which way the opening changes to let go: 1 it grows, −1 it shrinks, 0 it stays."""
    return {EXTERNAL: 1.0, INTERNAL: -1.0}.get(grip, 0.0)


def clearance_mm(grip: str, *asked_mm: float) -> float:
    """By how much the opening has to change to let go: the most of what is asked, nothing where the hand does not close."""
    return 0.0 if grip == SURFACE else max(asked_mm)


TAPER_LIMIT_RAD = math.radians(45.0)
"""Of tapered tips: no friction holds a steeper one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GripRequirement:
    """What a rule asks of a gripper before the assembly is considered.

    `approach_C` are unit vectors along which the gripper's +z may point; empty: any direction that keeps the fingers on
    the surfaces. `grip_axes_C` are the directions across which a parallel gripper closes; empty for centric ones.
    `taper_rad` inclines the gripping surfaces to the gripper's axis (`domain.taper`); 0: they are parallel to it.
    `vee` asks for tips with a V (`domain.v_tip`), of that taper; None: they are flat.
    """

    gripper_type: str
    opening_width_mm: float
    grip: str = EXTERNAL
    approach_C: FloatArray  # (a, 3)
    grip_axes_C: FloatArray  # (b, 3)
    primitive: Primitive
    rule: str = ""
    preferences: tuple[Preference, ...] = ()  # of the house's policies; the host fills them in
    taper_rad: float = field(default=0.0, metadata=LATER)
    vee: Vee | None = field(default=None, metadata=LATER)

    def __post_init__(self) -> None:
        if self.taper_rad and (self.grip != EXTERNAL or not abs(self.taper_rad) < TAPER_LIMIT_RAD):
            degrees, limit = math.degrees(self.taper_rad), math.degrees(TAPER_LIMIT_RAD)
            raise ValueError(
                f"tapered tips hold from outside, at less than {limit:.0f}°; asked for is {self.grip}, {degrees:.1f}°"
            )
        if self.vee is not None and (self.grip, self.gripper_type) != (EXTERNAL, PARALLEL_2):
            raise ValueError(f"V tips are of {PARALLEL_2} and hold from outside; asked for is {self.gripper_type}, {self.grip}")


_SHORTEST_FINGER_MM = 5.0  # a finger has some length, also where a grasp asks for none


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grasp:
    """A hand pose on a component: `X_CG` is the gripper frame seen from the component's.

    `leeway` are the grasps in between that this one stands for: turned about the gripper's x and z (rad), and shifted along
    its y and z (mm), each from … to. They are judged where none of the planned grasps is free; None: there are none.
    """

    X_CG: FloatArray  # (4, 4)
    gripper_type: str
    grip: str
    opening_width_mm: float
    contact_offset_mm: float = 0.0
    label: str = ""  # how it was planned, for the report: "axis +z, depth 3.2, 30°"
    leeway: FloatArray | None = None  # (4, 2)
    taper_rad: float = field(default=0.0, metadata=LATER)  # as of its requirement
    vee: Vee | None = field(default=None, metadata=LATER)  # as of its requirement


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hold:
    """What holding a grasp asks of the gripper."""

    required_force_N: float  # total grip force that holding needs, safety factor 1
    moment_Nmm: float  # largest moment about the contacts
    symmetry: float  # 1: the insertion force acts on the grip axis
    contact_area_mm2: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FreeGrasp:
    """A grasp that holds during one operation, with its bounds on the finger length.

    `finger_length_min_mm[k]` is L⁻ for a palm envelope of `envelopes_mm[k]` (see HandModel); inf where none helps.
    """

    grasp: Grasp
    envelopes_mm: FloatArray  # (e,)
    finger_length_min_mm: FloatArray  # (e,)
    finger_length_max_mm: float  # inf: unbounded
    release_opening_mm: float
    gap_mm: float  # estimate; verify states the measured one
    hold: Hold
    rise: float = 0.0  # z of the approach direction in the product frame at the end: −1 the hand points down, 1 up
    preferences: tuple[Preference, ...] = ()  # of its requirement

    @property
    def bending_Nmm(self) -> float:
        """What fingers have to bear of it at the least: the whole grip force at the end of fingers no longer than it needs."""
        return self.hold.required_force_N * max(float(self.finger_length_min_mm.min()), _SHORTEST_FINGER_MM)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearestMiss:
    """Of the grasps of a rejected segment the one that came closest, and the constraint that it misses by most.

    It needs `limit` of `quantity` and has `found`; `amount` is what is missing, in `unit`.
    """

    code: str
    quantity: str  # "clearance", "contact height", "surface gap", "grip force", "friction", "opening", "no-grasp", "hold"
    found: float | None
    limit: float
    amount: float | None
    unit: str  # "mm", "N", "" for a coefficient
    sentence: str
    gripper_type: str
    grip: str
    opening_width_mm: float
    grasp: Grasp | None = None  # None: no gripper goes in, however it is turned
    finger_length_mm: float | None = None
    palm_radius_mm: float | None = None
    part: str | None = None  # of the gripper: "finger 2", "palm"
    side: str | None = None  # of that part, where the way out is shortest: "tip", "outer face", "side", "gripping face", "back"
    hit: str | None = None  # component or obstacle; the held component itself, where it is its own body
    phase: str | None = None  # "taking-up", "closing", "motion", "opening", "leaving", "holding"
    place: float | None = None  # share of the motion, by path, at which it first comes too near
    point_P: FloatArray | None = None  # (3,) where, product frame; of what moves with the component, before the motion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SegmentVerdict:
    """How one segment of one component fares in one operation: free grasps, or the first constraint that failed."""

    segment: int
    requirement: GripRequirement | None
    grasps_planned: int
    free: tuple[FreeGrasp, ...]
    rejection: Rejection | None
    nearest_miss: NearestMiss | None = None
    searched: str = ""  # how finely between the planned grasps, in words: "searched to 1.9°, 0.65 mm"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OperationVerdict:
    """All segments of the components that the gripper may hold in one operation."""

    operation: str
    components: dict[str, tuple[SegmentVerdict, ...]]
    warnings: tuple[str, ...]
    timings: dict[str, float]
    kind: str = "unknown"  # peg-in-hole, placing, screwing, press-fit, meshing
    evidence: dict[str, Any] = field(default_factory=dict)  # JSON, mm and degrees: why it is called so
    force_N: float = 0.0  # insertion force that was reckoned with


@dataclass(frozen=True, slots=True, kw_only=True)
class GraspConstraint:
    """C_ij = {F, W, L⁻, L⁺} of one alternative; bounds are closed, `finger_length_max_mm` may be inf.

    `release_clearance_mm` is how much the opening has to change to let go of this grasp, where that is more than the
    problem's own clearance.
    """

    gripper_type: str
    opening_width_mm: float
    finger_length_min_mm: float
    finger_length_max_mm: float
    release_clearance_mm: float = 0.0
