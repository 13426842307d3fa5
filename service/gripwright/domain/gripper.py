"""Actuators, gripper parameters and the gripper set."""

from dataclasses import dataclass, field, replace

from gripwright.domain.grasp import EXTERNAL, INTERNAL, Grasp, GraspConstraint, Hold
from gripwright.domain.grasp import clearance_mm as clearance_of
from gripwright.domain.groove import Groove
from gripwright.domain.later import LATER
from gripwright.domain.pad import PAD, Pad
from gripwright.domain.preference import Preference
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.domain.v_tip import Vee

BOUND_TOLERANCE_MM = 1e-9
"""Closed bounds: two figures that are equal as decimals stay equal when binary sums of them differ in the last digit."""


NO_STROKE = "none"
"""`Actuator.stroke_basis` of one that closes nothing: a vacuum generator with its cup, a magnet."""

FINGER_TOO_HEAVY = "finger-too-heavy"
"""Code of a finger designer's rejection after which another actuator, or a shorter finger, is tried."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Actuator:
    """A bought gripper actuator (air chuck, electric gripper). None: the maker's figure is not known."""

    maker: str
    model: str
    gripper_type: str
    stroke_mm: float  # total change of opening width (diameter for centric ones); 0: not known, or none
    opening_max_mm: float | None = None  # distance of the jaws' own references, fully open; the largest face where it has none
    grip_force_N: float | None = None  # total: the sum over the jaws; of one without jaws that at its largest face
    mass_kg: float | None = None
    finger_length_max_mm: float | None = None
    finger_mass_max_kg: float | None = None
    body_diameter_mm: float | None = None
    body_length_mm: float | None = None
    price: float | None = None
    stroke_basis: str = "total"  # as the maker states it: total, diameter, per-jaw; none: it has no jaws
    force_basis: str = "unknown"  # as the maker states it: total, per-jaw, unknown
    confidence: str = "B"  # A: from the maker's data sheet, B: second hand, C: sources conflict
    source: str = ""
    note: str = ""

    @property
    def name(self) -> str:
        """Maker and model, as plans and BOMs name it."""
        return f"{self.maker}/{self.model}"

    @property
    def closes(self) -> bool:
        """Whether it has jaws that move."""
        return self.stroke_basis != NO_STROKE


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperParameters:
    """One candidate gripper: P_j = {F_j, W_j⁻, W_j⁺, L_j}."""

    gripper_type: str
    opening_min_mm: float
    opening_max_mm: float
    finger_length_mm: float
    grip: str = EXTERNAL

    def satisfies(self, constraint: GraspConstraint, release_clearance_mm: float) -> bool:
        """Whether a_ij = 1 (Eq. 2). Bounds are closed; the release asks for room to open (close, for an internal grip)."""
        if self.gripper_type != constraint.gripper_type:
            return False
        low, high = self.opening_min_mm, self.opening_max_mm
        clearance_mm = clearance_of(self.grip, release_clearance_mm, constraint.release_clearance_mm)
        if self.grip == INTERNAL:
            low += clearance_mm
        else:
            high -= clearance_mm
        width, length, slack = constraint.opening_width_mm, self.finger_length_mm, BOUND_TOLERANCE_MM
        return (
            low - slack <= width <= high + slack
            and constraint.finger_length_min_mm - slack <= length <= constraint.finger_length_max_mm + slack
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Handle:
    """One operation that a gripper does: where it holds which component, and how well."""

    operation: str
    component: str
    segment: int
    opening_width_mm: float
    release_opening_mm: float
    grasp: Grasp
    gap_mm: float
    hold: Hold
    safety_factor: float | None  # grip force over the force that holding needs; None: the actuator's force is unknown
    grip_force_N: float | None = field(default=None, metadata=LATER)  # with this face, of an actuator without jaws
    preferences: tuple[Preference, ...] = ()  # of the house's policies
    bending_Nmm: float = field(default=0.0, metadata=LATER)  # `FreeGrasp.bending_Nmm` of the grasp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gripper:
    """A gripper of the set: actuator, opening range, finger length and what it handles."""

    id: str
    gripper_type: str
    fingers: int
    grip: str
    opening_min_mm: float
    opening_max_mm: float
    finger_length_mm: float
    actuator: Actuator
    jaw_offset_mm: float
    envelope_mm: float  # radius of the palm envelope that the constraints assumed
    handles: tuple[Handle, ...]
    groove: Groove | None = None  # of concave tips; None: they are not shaped
    taper_rad: float = field(default=0.0, metadata=LATER)  # of its tips (`domain.taper`); 0: straight
    vee: Vee | None = field(default=None, metadata=LATER)  # of its tips (`domain.v_tip`); None: they are flat


def without_handles(gripper: Gripper) -> Gripper:
    """The gripper itself, whatever it handles."""
    return replace(gripper, handles=())


@dataclass(frozen=True, slots=True, kw_only=True)
class BoughtPart:
    """A part that is bought for a finger, as a bill of materials names it."""

    item: str  # "suction cup"
    designation: str  # what a buyer looks for: "flat suction cup 40 mm, NBR, thread G1/8"
    description: str  # where it belongs
    material: str = ""
    quantity: int = 1  # a finger
    mass_kg: float | None = None  # of one


@dataclass(frozen=True, slots=True, kw_only=True)
class JawInterface:
    """Where a finger is bolted to a jaw. The jaw's reference is its inner face; its front face carries the finger's base.

    The jaw reaches `depth_mm` outwards from the reference. Two threads lie on a line across it, symmetric about the jaw's
    middle, with a locating pin half way between them. The defaults stand wherever the maker's interface is not known.
    """

    depth_mm: float = 14.0
    width_mm: float = 28.0
    height_mm: float = 10.0
    bolt_setback_mm: float = 7.0  # from the reference outwards to the line of the threads
    bolt_pitch_mm: float = 18.0
    bolt_thread_mm: float = 4.0  # M4
    pin_diameter_mm: float = 3.0  # 0: no pin
    pin_length_mm: float = 5.0  # how far it stands out of the jaw


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FingerSpec:
    """What a finger designer is asked for. All in the finger frame F (gripping surface x = 0, tip end z = 0)."""

    gripper_type: str
    grip: str
    finger_length_mm: float
    jaw_offset_mm: float
    opening_min_mm: float
    opening_max_mm: float
    stroke_mm: float
    fingers: int
    envelope_mm: float  # nothing of the finger may lie farther from the gripper's axis, at opening_max
    actuator: Actuator
    contact_radii_mm: tuple[float, ...]  # of the components held; inf for flat ones
    grip_force_N: float  # total: the sum over the fingers
    jaw: JawInterface = JawInterface()  # the jaw's reference stands at x = −jaw_offset_mm
    pad: Pad = PAD  # with which its grasps are held
    groove: Groove | None = None  # its tip is concave: its stem reaches farther to x ≥ 0 by the groove's depth
    taper_rad: float = field(default=0.0, metadata=LATER)  # of its tip (`domain.taper`): the stem reaches farther to x ≥ 0
    vee: Vee | None = field(default=None, metadata=LATER)  # of its tip (`domain.v_tip`): it is as wide, and reaches farther, too


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MadePart:
    """A part that is made of one material: exact solid (OCP's binary BRep) in the finger frame, and its closed mesh."""

    brep: bytes
    mesh: Mesh
    material: str
    mass_kg: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BondedFinger:
    """The two parts of a finger that has a pad: together they are the finger.

    Where `bought` is set, the second is no pad that is cut and bonded but a part that is bought and put on: a suction cup.
    """

    bare: MadePart
    pad: MadePart
    pad_size_mm: tuple[float, float, float]  # thickness, width and length of the flat strip that it is cut as
    adhesive: str
    bought: BoughtPart | None = field(default=None, metadata=LATER)


def second_part(bonded: BondedFinger) -> str:
    """What the second part is called: pad, or what is bought for it."""
    return "pad" if bonded.bought is None else bonded.bought.item


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FingerDesign:
    """A finger as it touches: exact solid (OCP's binary BRep) in the finger frame, and its closed mesh."""

    brep: bytes
    mesh: Mesh
    material: str  # without its pad
    volume_mm3: float
    mass_kg: float
    properties: dict[str, float] = field(default_factory=dict)  # deflection_mm, wall_min_mm, …
    bonded: BondedFinger | None = None  # None: it is one piece
    name: str = field(default="finger", metadata=LATER)  # what bills and drawings call it: "cup holder"
    bought: tuple[BoughtPart, ...] | None = field(default=None, metadata=LATER)  # None: screws and pin of its jaw
    notes: tuple[str, ...] | None = field(default=None, metadata=LATER)  # lines on its drawing; None: those of a finger on a jaw


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConvexSolid:
    """The convex hull of some points, in the frame its producer states."""

    vertices_mm: FloatArray  # (n, 3)
    role: str  # "finger-1", "palm", "body", …
