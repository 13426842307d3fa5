"""By how much a grasp misses each constraint of an operation: collisions, contact, forbidden surface, friction.

Collisions are measured as `geometry.penetration` says, margin included: so much of the other body would have to give way on
that side, or so much less of the gripper be there.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.design.contact import (
    SPREAD_MM,
    contact_heights_mm,
    contacts,
    forbidden_reaches,
    needed_height_mm,
    standing_off_mm,
)
from gripwright.design.finger_lengths import length_min
from gripwright.design.hand_check import ENTER_MM, LENGTH_LIMIT_MM, ROUGH_MM, HandCheck, Miss, OperationScene
from gripwright.design.hand_volumes import HandVolumes, Intrusion, Volume
from gripwright.design.holder import Holder, Models, least_length_mm
from gripwright.design.holding import hold
from gripwright.design.tapered_hand import thicker_mm
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, SURFACE, Grasp, GripRequirement
from gripwright.domain.holding import Load
from gripwright.domain.shape import FloatArray
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api import HandModel, RunContext

HOLDING = "holding"
MEASURED, FAR_OFF = 0, 1  # ranks: what no shift of some millimetres mends comes last
PLACED = 4  # stage of a miss from which on a grasp has passed the checks that are made before it is seated
_FRICTION_MAX = 2.0

Envelopes = Callable[[str, float], FloatArray]
"""(gripper type, opening width) → radii of the palm envelopes that the actuators at hand need, ascending."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shortage:
    """One constraint that a grasp misses: it needs `limit` of a quantity and has `found`."""

    code: str
    quantity: str
    found: float
    limit: float
    amount: float  # what is missing
    unit: str = "mm"
    rank: int = 0
    part: str | None = None
    side: str | None = None
    hit: str | None = None
    phase: str = HOLDING
    intrusion: Intrusion | None = None
    words: str = ""  # what a sentence needs besides: the reason of a forbidden region, the gripper's type


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Attempt:
    """Grasps of one requirement that failed."""

    requirement: GripRequirement
    hand: HandModel
    check: HandCheck
    radius_mm: float  # of the relative curvature at a contact
    missed: Sequence[Miss]  # each with its grasp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Circumstances:
    """What grasps of one component are judged by in one operation."""

    scene: OperationScene
    surface: Surface
    regions: Sequence[tuple[Forbidden, Surface]]
    load: Load
    component: Component
    envelopes: Envelopes
    models: Models
    ctx: RunContext


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Finding:
    """A grasp, seated where it can be, with all that it misses."""

    grasp: Grasp
    finger_length_mm: float
    palm_radius_mm: float | None
    shortages: tuple[Shortage, ...]


class Gauge:
    """Measures the grasps of one attempt."""

    def __init__(self, attempt: Attempt, around: Circumstances) -> None:
        self._attempt, self._around = attempt, around
        self._hand, self._volumes = attempt.hand, HandVolumes(around.scene, attempt.hand)
        self._holder = Holder(model=around.models.get(attempt.requirement.gripper_type), ctx=around.ctx)
        self._tips = least_length_mm(attempt.hand, around.ctx)

    def glance(self, miss: Miss) -> list[Shortage]:
        """What a grasp lacks, at least, of the check that it failed before it was placed."""
        grasp, tips = miss.grasp, self._tips
        assert grasp is not None
        match miss.stage:
            case 0:
                volumes = self._volumes.reaching(grasp, tips)
            case 1:
                volumes = self._volumes.closing(grasp, tips, ROUGH_MM)
            case 2:
                volumes = self._volumes.leaving(grasp, tips)
            case _:
                volumes = self._volumes.moving(grasp, tips)
        return [self._collision(found) for volume in volumes for found in self._volumes.glances(volume)]

    def in_full(self, grasp: Grasp) -> Finding:
        """All that a grasp lacks."""
        around, volumes = self._around, self._volumes
        seated = self._holder.seat(grasp, around.surface, self._hand)
        placed, draw_back = (seated, ENTER_MM) if isinstance(seated, Grasp) else (grasp, ROUGH_MM)
        lacking = [] if isinstance(seated, Grasp) else self._unseated(grasp, seated)
        length, palm = self._tips, None
        widths = around.envelopes(placed.gripper_type, placed.opening_width_mm + 2.0 * thicker_mm(self._hand))
        if len(widths) == 0:
            lacking.append(self._no_actuator(placed))
        else:
            palm = float(widths[0])
            lengths, miss = length_min(self._attempt.check, placed, widths[:1], self._tips)
            length = float(lengths[0]) if miss is None else LENGTH_LIMIT_MM
            lacking += [] if miss is None else self._reached(volumes.palm(placed, palm, LENGTH_LIMIT_MM))
            length = length if miss is None else self._tips
        lacking += self._reached(volumes.reaching(placed, length))
        lacking += self._reached(volumes.closing(placed, length, draw_back))
        lacking += self._reached(volumes.leaving(placed, length))
        lacking += self._reached(volumes.moving(placed, length))
        lacking += [*self._forbidden(placed, length), *(self._contact(placed, length) if placed is seated else [])]
        lacking += [] if lacking else self._not_held(placed, length)
        return Finding(grasp=placed, finger_length_mm=length, palm_radius_mm=palm, shortages=tuple(lacking))

    def first_place(self, intrusion: Intrusion) -> tuple[float, FloatArray] | None:
        """As `HandVolumes.first_place`."""
        return self._volumes.first_place(intrusion)

    def _reached(self, volumes: Iterator[Volume]) -> list[Shortage]:
        """Bodies that reach into the volumes."""
        return [self._collision(found) for volume in volumes for found in self._volumes.intrusions(volume)]

    def _collision(self, found: Intrusion) -> Shortage:
        volume = found.volume
        return Shortage(
            code="collision",
            quantity="clearance",
            found=volume.margin_mm - found.depth_mm,
            limit=volume.margin_mm,
            amount=found.depth_mm,
            part=volume.part,
            side=_side(volume, found.normal, self._attempt.requirement.grip),
            hit=found.body.name,
            phase=volume.phase,
            intrusion=found,
        )

    def _unseated(self, grasp: Grasp, why: Rejection) -> list[Shortage]:
        """Fingers that meet no surface, or stay off it while another one touches."""
        if self._holder.model is not None:
            return [_said(why)]
        lacking = []
        for number, off in enumerate(standing_off_mm(grasp, self._around.surface, self._hand), start=1):
            if off is None:
                lacking.append(self._untouched(grasp, number, 0.0, FAR_OFF))
            elif off > SPREAD_MM:
                lacking.append(
                    Shortage(
                        code="no-contact",
                        quantity="surface gap",
                        found=off,
                        limit=SPREAD_MM,
                        amount=off - SPREAD_MM,
                        part=f"finger {number}",
                    )
                )
        return lacking

    def _contact(self, grasp: Grasp, finger_length_mm: float) -> list[Shortage]:
        if self._holder.model is not None:
            touching = self._holder.contacts(grasp, self._around.surface, self._hand, finger_length_mm)
            return [_said(touching)] if isinstance(touching, Rejection) else []
        heights = contact_heights_mm(grasp, self._around.surface, self._hand, finger_length_mm)
        needed = needed_height_mm(grasp, self._around.surface, self._around.ctx.min_contact_mm)
        return [
            self._untouched(grasp, number, height, MEASURED if height > 0.0 else FAR_OFF)
            for number, height in enumerate(heights, start=1)
            if height < needed - 1e-6
        ]

    def _untouched(self, grasp: Grasp, number: int, height_mm: float, rank: int) -> Shortage:
        needed = needed_height_mm(grasp, self._around.surface, self._around.ctx.min_contact_mm)
        return Shortage(
            code="no-contact",
            quantity="contact height",
            found=height_mm,
            limit=needed,
            amount=needed - height_mm,
            rank=rank,
            part=f"finger {number}",
        )

    def _forbidden(self, grasp: Grasp, finger_length_mm: float) -> list[Shortage]:
        return [
            Shortage(
                code="no-grasp",
                quantity="forbidden surface",
                found=depth,
                limit=0.0,
                amount=depth,
                part=f"finger {number}",
                words=region.reason,
            )
            for number, region, depth in forbidden_reaches(grasp, self._around.regions, self._hand, finger_length_mm)
        ]

    def _no_actuator(self, grasp: Grasp) -> Shortage:
        width = grasp.opening_width_mm
        return Shortage(
            code="too-wide", quantity="opening", found=0.0, limit=width, amount=width, rank=FAR_OFF, words=grasp.gripper_type
        )

    def _not_held(self, grasp: Grasp, finger_length_mm: float) -> list[Shortage]:
        """What holding lacks: of jaws the coefficient of friction from which on some grip force holds, where none does."""
        if self._holder.model is None:
            return self._friction(grasp, finger_length_mm)
        touching = self._holder.contacts(grasp, self._around.surface, self._hand, finger_length_mm)
        if isinstance(touching, Rejection):
            return []
        held = self._holder.hold(grasp, touching, self._attempt.radius_mm, self._around.load, self._around.component)
        return [_said(held)] if isinstance(held, Rejection) else []

    def _friction(self, grasp: Grasp, finger_length_mm: float) -> list[Shortage]:
        around, friction = self._around, self._around.component.friction
        touching = contacts(grasp, around.surface, self._hand, finger_length_mm, around.ctx.min_contact_mm)
        if not isinstance(touching, tuple):
            return []

        def held(friction: float) -> bool:
            held = hold(grasp, touching, self._attempt.radius_mm, around.load, friction, around.ctx.pad)
            return bool(np.isfinite(held.required_force_N))

        if held(friction):
            return []
        low, high = friction, _FRICTION_MAX
        while held(high) and high - low > 0.005:
            middle = (low + high) / 2.0
            low, high = (low, middle) if held(middle) else (middle, high)
        return [
            Shortage(
                code="not-held",
                quantity="friction",
                found=friction,
                limit=high,
                amount=high - friction,
                unit="",
            )
        ]


def _said(why: Rejection) -> Shortage:
    """What a holding plug-in refuses, in its own words: its figures are in the sentence."""
    return Shortage(code=why.code, quantity="hold", found=0.0, limit=1.0, amount=1.0, unit="", rank=FAR_OFF, words=why.detail)


def _side(volume: Volume, normal: FloatArray, grip: str) -> str:
    """The side of the finger or palm through whose face the way out is shortest."""
    axis = int(np.argmax(np.abs(normal)))
    if volume.part == "the palm":
        return "rim" if axis < 2 else "front" if normal[2] > 0.0 else "back"
    if axis == 2:
        return "tip" if normal[2] > 0.0 else "back"
    if axis == 1 or grip == SURFACE:
        return "side"
    return "outer face" if (normal[0] > 0.0) == (grip == EXTERNAL) else "gripping face"
