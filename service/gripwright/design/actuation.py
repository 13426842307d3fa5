"""Which actuators can serve which grasps: classes of grippers for the optimiser, each one actuator with one palm envelope."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gripwright.design import catalogue
from gripwright.design.holder import Models, grip_force_N
from gripwright.design.tapered_hand import taper_rad_of, thicker_mm, vee_of
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, INTERNAL, SURFACE, FreeGrasp, GraspConstraint
from gripwright.domain.grasp import clearance_mm as clearance_of
from gripwright.domain.gripper import Actuator, Gripper
from gripwright.domain.gripper_set import GripperClass
from gripwright.domain.preference import Preference, weight
from gripwright.domain.v_tip import Vee, same_vee
from gripwright.plugin_api import HandModel

ARM_MAX_MM = 100.0
"""How far a finger's offset arm may carry the gripping surface outwards from the jaw's reference."""

UNKNOWN_FORCE_COST = 1000.0
"""Added to the cost of an actuator of unknown force: it is taken where it saves a gripper, not where it saves mass."""

SAME_TAPER_RAD = 1e-5
"""Tapers that differ by less are one: figures of documents are rounded."""

_SLACK_MM = 1e-9
_SHORTER_MM = 0.01  # than what was found too heavy


@dataclass(frozen=True, slots=True)
class Shortfall:
    """Why an actuator does not serve a grasp, and by how much (mm or N) it falls short."""

    code: str
    detail: str
    amount: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldPolicy:
    """What is asked of the grip force."""

    safety_factor: float
    enforced: bool
    models: Models = field(default_factory=dict)

    def grip_force_N(self, actuator: Actuator, opening_width_mm: float) -> float | None:
        """What the actuator grips with at that opening; None: not known."""
        return grip_force_N(actuator, opening_width_mm, self.models)

    def weakness(self, actuator: Actuator, opening_width_mm: float, required_force_N: float) -> Shortfall | None:
        """Why this actuator does not hold; None where it does, where its force is unknown, and where nothing is enforced."""
        needed_N, force_N = required_force_N * self.safety_factor, self.grip_force_N(actuator, opening_width_mm)
        if not self.enforced or force_N is None or force_N >= needed_N:
            return None
        what = "friction" if actuator.closes else "holding"
        return Shortfall(
            "not-held",
            f"{what} needs {needed_N:.1f} N with safety factor {self.safety_factor:g}, "
            f"{actuator.name} grips with {force_N:.1f} N",
            needed_N - force_N,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ActuatorClass:
    """One actuator within one palm envelope: `opening_max_mm` is the widest that its fingers may open in it."""

    key: str
    actuator: Actuator
    fingers: int
    grip: str
    envelope_mm: float
    opening_max_mm: float
    gripper_class: GripperClass
    taper_rad: float = 0.0  # of the fingers' tips
    vee: Vee | None = None  # of the fingers' tips
    length_limit: str = ""  # why the fingers are no longer, where it is not the maker who says so

    def serves(self, free: FreeGrasp) -> bool:
        """Whether a grasp asks for this type of gripper."""
        grasp = free.grasp
        same_tips = abs(grasp.taper_rad - self.taper_rad) < SAME_TAPER_RAD and same_vee(grasp.vee, self.vee)
        same_fingers = grasp.grip == self.grip and same_tips
        return grasp.gripper_type == self.actuator.gripper_type and same_fingers

    def constraint(self, free: FreeGrasp, release_clearance_mm: float, policy: HoldPolicy) -> GraspConstraint | Shortfall:
        """What a gripper of this class has to satisfy to hold a grasp, or why none does."""
        grasp, actuator = free.grasp, self.actuator
        clearance_mm = clearance_of(self.grip, release_clearance_mm, abs(free.release_opening_mm - grasp.opening_width_mm))
        if clearance_mm > actuator.stroke_mm + _SLACK_MM:
            detail = f"letting go takes {clearance_mm:.2f} mm, the stroke of {actuator.name} is {actuator.stroke_mm:.2f} mm"
            return Shortfall("stroke-too-short", detail, clearance_mm - actuator.stroke_mm)
        widest_mm = grasp.opening_width_mm + (actuator.stroke_mm - clearance_mm if self.grip == INTERNAL else clearance_mm)
        if widest_mm > self.opening_max_mm + _SLACK_MM:
            detail = f"the opening must reach {widest_mm:.2f} mm, {actuator.name} opens to {self.opening_max_mm:.2f} mm"
            if self.grip == SURFACE:
                detail = (
                    f"a face of {widest_mm:.2f} mm is asked for, that of {actuator.name} has {self.opening_max_mm:.2f} mm at most"
                )
            return Shortfall("too-wide", detail, widest_mm - self.opening_max_mm)
        floor_mm = self.gripper_class.opening_floor_mm
        closed_mm = grasp.opening_width_mm - (clearance_mm if self.grip == INTERNAL else 0.0)
        if closed_mm < floor_mm - _SLACK_MM:
            detail = f"the opening must fall to {closed_mm:.2f} mm, the fingers meet below {floor_mm:.2f} mm"
            return Shortfall("too-narrow", detail, floor_mm - closed_mm)
        length_min_mm = _length_min_mm(free, self.envelope_mm)
        length_max_mm = min(free.finger_length_max_mm, self.gripper_class.finger_length_max_mm)
        if math.isinf(length_min_mm):
            return Shortfall("finger-too-long", f"no finger is long enough to keep {actuator.name} clear", math.inf)
        if length_min_mm > length_max_mm + _SLACK_MM:
            detail = f"{actuator.name} needs fingers of at least {length_min_mm:.2f} mm, {length_max_mm:.2f} mm are allowed"
            detail += f": {self.length_limit}" if self.length_limit else ""
            return Shortfall("finger-too-long", detail, length_min_mm - length_max_mm)
        return policy.weakness(actuator, grasp.opening_width_mm, free.hold.required_force_N) or GraspConstraint(
            gripper_type=self.key,
            opening_width_mm=grasp.opening_width_mm,
            finger_length_min_mm=length_min_mm,
            finger_length_max_mm=length_max_mm,
            release_clearance_mm=clearance_mm,
        )


def costs_of(
    actuators: Sequence[Actuator], policy: HoldPolicy, preferences: Mapping[str, Sequence[Preference]]
) -> dict[str, float]:
    """Cost of each actuator by name: prices where all are known, else masses (kg), by the factors of the house's preferences;
    an unknown force counts extra."""
    priced = all(actuator.price is not None for actuator in actuators)
    return {
        actuator.name: ((actuator.price if priced else None) or catalogue.mass_or_default_kg(actuator))
        * weight(preferences.get(actuator.name, ()))
        + (UNKNOWN_FORCE_COST if policy.enforced and actuator.grip_force_N is None else 0.0)
        for actuator in actuators
    }


def classes_of(
    actuators: Sequence[Actuator], costs: Mapping[str, float], grasps: Sequence[FreeGrasp], hand: HandModel, grip: str
) -> list[ActuatorClass]:
    """Classes of those actuators for grasps of the hand's type: each with the palm envelopes that the grasps were judged with.

    An envelope that admits no wider opening than a smaller one that the actuator fits in is left out.
    """
    taper_rad, vee = taper_rad_of(hand), vee_of(hand)
    tips = f"|{np.degrees(taper_rad):.4f}°" if taper_rad else ""
    tips += "" if vee is None else f"|V {vee.degrees:.4f}° {vee.depth_mm:.4f}"
    rungs = np.unique(np.concatenate([free.envelopes_mm for free in grasps])) if grasps else np.empty(0)
    widest_mm = max((free.release_opening_mm for free in grasps), default=0.0)
    classes = []
    for actuator in actuators:
        arms_mm = _opening_limit_mm(actuator)
        needed_mm = min(widest_mm + actuator.stroke_mm if grip == INTERNAL else widest_mm, arms_mm)
        gripper_class = GripperClass(
            stroke_mm=actuator.stroke_mm,
            grip=grip,
            opening_floor_mm=hand.opening_floor_mm(grip),
            finger_length_max_mm=_finger_length_max_mm(actuator),
            cost=costs[actuator.name],
        )
        for envelope_mm in rungs[rungs >= catalogue.actuator_envelope_mm(actuator) - _SLACK_MM].tolist():
            within_mm = catalogue.opening_within_mm(envelope_mm) - 2.0 * thicker_mm(hand)
            opening_mm = arms_mm if grip == SURFACE else min(within_mm, arms_mm)
            if opening_mm <= 0.0:
                continue
            classes.append(
                ActuatorClass(
                    key=f"{actuator.name}|{grip}|{envelope_mm:g}{tips}",
                    actuator=actuator,
                    fingers=hand.fingers,
                    grip=grip,
                    envelope_mm=envelope_mm,
                    opening_max_mm=opening_mm,
                    gripper_class=gripper_class,
                    taper_rad=taper_rad,
                    vee=vee,
                )
            )
            if opening_mm >= needed_mm:
                break
    return classes


def with_shorter_fingers(kind: ActuatorClass, too_heavy: Mapping[str, Mapping[str, Any]]) -> ActuatorClass:
    """The class with fingers shorter than those that were found too heavy for its actuator."""
    if kind.actuator.name not in too_heavy:
        return kind
    found = too_heavy[kind.actuator.name]
    length_mm = min(kind.gripper_class.finger_length_max_mm, found["finger_length"] - _SHORTER_MM)
    gripper_class = replace(kind.gripper_class, finger_length_max_mm=length_mm)
    return replace(kind, gripper_class=gripper_class, length_limit=f"a longer one is too heavy, {found['detail']}")


def owned_class(key: str, owned: Gripper, hand: HandModel) -> ActuatorClass:
    """The class of a gripper that is at hand, with its own opening range and finger length."""
    return ActuatorClass(
        key=key,
        actuator=owned.actuator,
        fingers=owned.fingers,
        grip=owned.grip,
        envelope_mm=owned.envelope_mm,
        opening_max_mm=owned.opening_max_mm,
        taper_rad=owned.taper_rad,
        vee=owned.vee,
        gripper_class=GripperClass(
            stroke_mm=owned.opening_max_mm - owned.opening_min_mm,
            grip=owned.grip,
            opening_floor_mm=hand.opening_floor_mm(owned.grip),
        ),
    )


def outdone(actuators: Sequence[Actuator], costs: Mapping[str, float], grip: str) -> dict[str, Rejection]:
    """Actuators that another one of their type outdoes in everything that selection weighs, by name."""
    found: dict[str, Rejection] = {}
    for actuator in actuators:
        for other in actuators:
            if other.name in found or other is actuator or not _outdoes(other, actuator, costs, grip):
                continue
            found[actuator.name] = Rejection(
                "outdone",
                f"{other.name} serves all grasps that {actuator.name} serves: stroke {other.stroke_mm:g} mm against "
                f"{actuator.stroke_mm:g} mm, no larger, no weaker, no dearer",
            )
            break
    return found


def _outdoes(other: Actuator, actuator: Actuator, costs: Mapping[str, float], grip: str) -> bool:
    def virtues(one: Actuator) -> tuple[float, ...]:
        return (
            -catalogue.actuator_envelope_mm(one),
            _opening_limit_mm(one),
            _finger_length_max_mm(one),
            math.inf if one.finger_mass_max_kg is None else one.finger_mass_max_kg,
            math.inf if one.grip_force_N is None else one.grip_force_N,
            -costs[one.name],
        )

    # An internal grip opens to W − clearance + stroke: there a longer stroke needs more room.
    # Forces of faces compare at one size.
    reaches = other.stroke_mm >= actuator.stroke_mm if grip == EXTERNAL else other.stroke_mm == actuator.stroke_mm
    if grip == SURFACE:
        reaches = other.opening_max_mm == actuator.opening_max_mm
    same_type = other.gripper_type == actuator.gripper_type
    return same_type and reaches and all(a >= b for a, b in zip(virtues(other), virtues(actuator), strict=True))


def _opening_limit_mm(actuator: Actuator) -> float:
    if not actuator.closes:
        return math.inf if actuator.opening_max_mm is None else actuator.opening_max_mm
    return catalogue.opening_reference_mm(actuator) + 2.0 * ARM_MAX_MM


def _finger_length_max_mm(actuator: Actuator) -> float:
    return math.inf if actuator.finger_length_max_mm is None else actuator.finger_length_max_mm


def _length_min_mm(free: FreeGrasp, envelope_mm: float) -> float:
    """L⁻ of the smallest envelope judged that is at least this one; inf where there is none."""
    k = int(np.searchsorted(free.envelopes_mm, envelope_mm - _SLACK_MM))
    return float(free.finger_length_min_mm[k]) if k < len(free.envelopes_mm) else math.inf
