"""The public contract: a Protocol for each kind of plug-in.

Lengths in mm, angles in rad, meshes and primitives in the component's frame C.

Common rules: `cls(params)` does no work; arguments are never changed; the same input and seed give the same result
(randomness from `ctx.rng` alone); an expected "no" is a `Rejection`, an exception means a defect; long work calls
`ctx.progress` every few seconds (cancellation arrives there as an exception: let it through); instances and results are
picklable.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Protocol, runtime_checkable

from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import Grasp, GripRequirement, Hold
from gripwright.domain.gripper import Actuator, ConvexSolid, FingerDesign, FingerSpec
from gripwright.domain.gripper_set import GripperSet, GripperSetProblem
from gripwright.domain.groove import Groove
from gripwright.domain.holding import Contact, Load
from gripwright.domain.preference import Preference
from gripwright.domain.shape import FloatArray, Primitive, Segment
from gripwright.domain.v_tip import Vee
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api.context import RunContext
from gripwright.plugin_api.params import Params


class Plugin(Protocol):
    """What every plug-in has: a key unique in its kind, and a parameter model that is constructible without arguments."""

    key: ClassVar[str]
    params_model: ClassVar[type[Params]]


class Segmenter(Plugin, Protocol):
    """Divides a component's surface into segments."""

    def segment(self, component: Component, ctx: RunContext) -> Sequence[Segment] | Rejection:
        """Partition the faces of `component.mesh`: every face is in exactly one segment, ids count from 0.

        A Rejection says what the segmenter needs that the mesh has not; the design is then refused.
        """
        ...


class PrimitiveFitter(Plugin, Protocol):
    """Fits one kind of primitive to a segment."""

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Primitive | Rejection:
        """The primitive that follows the segment's surface best, or why there is none."""
        ...


class AffordanceDetector(Plugin, Protocol):
    """Finds surface that must not be touched."""

    def detect(self, component: Component, segments: Sequence[Segment], ctx: RunContext) -> Sequence[Forbidden]:
        """Regions of the component that a finger must not touch, each with its evidence."""
        ...


class GripperRule(Plugin, Protocol):
    """Says which gripper holds a primitive."""

    accepts: ClassVar[frozenset[str]]  # primitive kinds, or "*" for all; the host dispatches on them

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """Grip requirements of this primitive, the preferred one first, or why it has none."""
        ...


class HandModel(Plugin, Protocol):
    """The hand of one gripper type as convex solids in the gripper frame G."""

    gripper_type: ClassVar[str]
    fingers: ClassVar[int]

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """X_GF of each finger, (fingers, 4, 4): Rz(θi)·Tx(W/2)."""
        ...

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """Stem and tip of one finger in the finger frame F; within x ≥ 0 (x ≤ 0 for an internal grip)."""
        ...

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """All that is not stem (bases, arms, actuator body): from z = −L back by `depth_mm`, within `envelope_mm` of the axis."""
        ...

    def opening_floor_mm(self, grip: str) -> float:
        """The opening below which the fingers would meet each other."""
        ...


@runtime_checkable
class FaceHand(HandModel, Protocol):
    """A hand model that holds by a face, with the grip `surface`: a suction cup, a magnet. It does not close.

    The face lies in z = 0 and looks along +z; the opening width is its diameter. `finger` gives what carries it, at
    −L ≤ z ≤ 0 about the z axis of its frame F, which `finger_poses` puts side by side in the plane z = 0 of G.
    """

    def sized(self, opening_width_mm: float) -> "FaceHand":
        """The hand whose face has that diameter. The host asks it for everything else."""
        ...

    def finger_length_min_mm(self) -> float:
        """The finger length from which on the hand, as it is sized, can be made: the face and what fastens it."""
        ...


class GraspPlanner(Plugin, Protocol):
    """Plans hand poses on one segment."""

    gripper_types: ClassVar[frozenset[str]]

    def plan(
        self, component: Component, segment: Segment, requirement: GripRequirement, hand: HandModel, ctx: RunContext
    ) -> Sequence[Grasp]:
        """Grasps worth trying, the most promising first; collisions are the host's business.

        Where none is free, the host judges those in between that a grasp says it stands for (`Grasp.leeway`, optional).
        """
        ...


class HoldingModel(Plugin, Protocol):
    """How grippers of some types hold that close no jaws: by suction, by magnetism. Grasps have the grip `surface`."""

    gripper_types: ClassVar[frozenset[str]]

    def seat(self, grasp: Grasp, surface: Surface, hand: HandModel, ctx: RunContext) -> Grasp | Rejection:
        """The grasp as it just touches, or why it cannot; it may not enter the component."""
        ...

    def contacts(
        self, grasp: Grasp, surface: Surface, hand: HandModel, finger_length_mm: float, ctx: RunContext
    ) -> Sequence[Contact] | Rejection:
        """What touches, of a seated grasp; one contact a face. Or why it does not touch as it must."""
        ...

    def hold(
        self, grasp: Grasp, contacts: Sequence[Contact], load: Load, component: Component, ctx: RunContext
    ) -> Hold | Rejection:
        """The least grip force that holds all of the load (`geometry.wrenches`), or why none does."""
        ...

    def grip_force_N(self, actuator: Actuator, opening_width_mm: float) -> float | None:
        """What an actuator of the catalogue holds with by a face of that size; None: it is not known."""
        ...


class GripperOptimizer(Plugin, Protocol):
    """Solves the gripper-set problem (Eq. 1 and 2 of the paper)."""

    def solve(self, problem: GripperSetProblem, ctx: RunContext) -> GripperSet:
        """The smallest set, with its lower bound; `proven` only where the two are equal and the solver says so."""
        ...


class FingerDesigner(Plugin, Protocol):
    """Makes the finger of a gripper."""

    gripper_types: ClassVar[frozenset[str]]

    def design(self, spec: FingerSpec, ctx: RunContext) -> FingerDesign | Rejection:
        """One finger that serves all its components, in the finger frame, or why it cannot be made."""
        ...


class HousePolicy(Plugin, Protocol):
    """What a house allows and what it likes, whatever the method says. `INDIFFERENT` is its answer to all else."""

    def grip(
        self, component: Component, segment: Segment, requirement: GripRequirement, marks: Mapping[str, float]
    ) -> Rejection | Preference:
        """Whether this segment may be gripped as a rule asks, and whether others are better.

        `marks` is the share of the segment's area (0..1) that no finger may touch, by reason: of what is marked in the package
        and of what was detected.
        """
        ...

    def actuator(self, actuator: Actuator) -> Rejection | Preference:
        """Whether this actuator may be bought; the factor of a preference is one on its cost."""
        ...


@runtime_checkable
class TaperedFingerDesigner(Protocol):
    """A finger designer that also makes tapered tips: a spec whose `taper_rad` is not 0 asks for one (`domain.taper`)."""

    def tapers(self, taper_rad: float) -> bool:
        """Whether it makes tips of this taper."""
        ...


@runtime_checkable
class VTipDesigner(Protocol):
    """A finger designer that also makes tips with a V: a spec whose `vee` is not None asks for one (`domain.v_tip`)."""

    def has_v(self, vee: Vee, taper_rad: float) -> bool:
        """Whether it makes tips with this V, tapered so much."""
        ...


@runtime_checkable
class TipShaper(Protocol):
    """A finger designer that also shapes tips to what a gripper holds: its `design` cuts the groove that the spec names."""

    def groove(self, contact_radii_mm: Sequence[float], width_mm: float) -> Groove | None:
        """The groove for cylinders of these radii, held from outside by tips of that width; None: flat tips do as well.

        It is asked where a three-finger gripper holds nothing else. The host keeps the groove only where all grasps hold with
        it about as well as before, and the finished CAD keeps every promise.
        """
        ...
