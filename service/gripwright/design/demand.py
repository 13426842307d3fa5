"""What the selection chooses from: what is on offer, and what each operation asks of a gripper."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from gripwright.design.actuation import (
    ActuatorClass,
    HoldPolicy,
    Shortfall,
    classes_of,
    costs_of,
    outdone,
    owned_class,
    with_shorter_fingers,
)
from gripwright.design.handles import HeldGrasp
from gripwright.design.not_chosen import ActuatorGrip
from gripwright.design.shortfall import closest
from gripwright.design.tapered_hand import tapered
from gripwright.design.toolbox import Toolbox
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import FreeGrasp, GraspConstraint
from gripwright.domain.gripper import Actuator, Gripper
from gripwright.domain.preference import Preference


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectOptions:
    """What a plan asks of the selection."""

    release_clearance_mm: float = 1.0
    finger_length_step_mm: float = 5.0
    safety_factor: float = 2.0
    enforce_hold: bool = True
    weigh_sequence: bool = True  # least cost and fewest tool changes before the shortest fingers
    owned: tuple[Gripper, ...] = ()
    too_heavy: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # actuator → `finger_length` (mm), `detail`
    preferences: Mapping[str, Sequence[Preference]] = field(default_factory=dict)  # of the house, by actuator
    refused: Sequence[tuple[Actuator, Rejection]] = ()  # by the house


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Offer:
    """What can be chosen: classes of actuators by key, those of owned grippers among them, and the actuators outdone."""

    classes: dict[str, ActuatorClass]
    owned: dict[str, int]  # key of a class → index of the owned gripper
    outdone: dict[ActuatorGrip, Rejection]
    costs: dict[str, float]  # by actuator name
    policy: HoldPolicy


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Demand:
    """What one operation asks of the grippers: one of the constraints, and what failed in the other classes."""

    constraints: tuple[GraspConstraint, ...]
    shortfalls: dict[ActuatorGrip, Shortfall]  # the closest


def offer_of(grasps: Sequence[HeldGrasp], actuators: Sequence[Actuator], options: SelectOptions, toolbox: Toolbox) -> Offer:
    """What can be bought, or is at hand, for what grasps ask of fingers; actuators that another one outdoes left out."""
    hands = toolbox.hands
    policy = HoldPolicy(safety_factor=options.safety_factor, enforced=options.enforce_hold, models=toolbox.holding)
    costs = costs_of(actuators, policy, options.preferences)
    classes: dict[str, ActuatorClass] = {}
    worse: dict[ActuatorGrip, Rejection] = {}
    for fingers in sorted({_fingers(held.free) for held in grasps}):
        frees = [held.free for held in grasps if _fingers(held.free) == fingers]
        (gripper_type, grip, *_), one = fingers, frees[0].grasp
        fitting = [actuator for actuator in actuators if actuator.gripper_type == gripper_type]
        beaten = outdone(fitting, costs, grip)
        worse.update({(name, grip): rejection for name, rejection in beaten.items()})
        best = [actuator for actuator in fitting if actuator.name not in beaten]
        for kind in classes_of(best, costs, frees, tapered(hands[gripper_type], one.taper_rad, one.vee), grip):
            classes[kind.key] = with_shorter_fingers(kind, options.too_heavy)
    owned = {f"owned|{i}": i for i in range(len(options.owned))}
    classes.update({key: owned_class(key, options.owned[i], hands[options.owned[i].gripper_type]) for key, i in owned.items()})
    return Offer(classes=classes, owned=owned, outdone=worse, costs=costs, policy=policy)


def demand_of(grasps: Sequence[HeldGrasp], offer: Offer, options: SelectOptions) -> Demand:
    """The constraints of an operation's grasps, and what is short where an actuator does not serve them."""
    distinct = {_figures(held.free): held.free for held in grasps}
    constraints: set[GraspConstraint] = set()
    shortfalls: dict[ActuatorGrip, set[Shortfall]] = {}
    for free in distinct.values():
        for kind in offer.classes.values():
            if not kind.serves(free):
                continue
            answer = kind.constraint(free, options.release_clearance_mm, offer.policy)
            if isinstance(answer, Shortfall):
                shortfalls.setdefault((kind.actuator.name, kind.grip), set()).add(answer)
            else:
                constraints.add(answer)
    return Demand(
        constraints=tuple(_widest(constraints)), shortfalls={which: closest(found) for which, found in shortfalls.items()}
    )


def _fingers(free: FreeGrasp) -> tuple[str, str, float, float, float]:
    """What a grasp asks of fingers: grippers of other fingers are of other classes."""
    grasp, vee = free.grasp, free.grasp.vee
    v = (0.0, 0.0) if vee is None else (vee.angle_rad, vee.depth_mm)
    return grasp.gripper_type, grasp.grip, grasp.taper_rad, *v


def _figures(free: FreeGrasp) -> tuple[object, ...]:
    """What selection knows of a grasp: grasps of the same figures make the same constraints."""
    return (
        *_fingers(free),
        free.grasp.opening_width_mm,
        free.release_opening_mm,
        free.finger_length_max_mm,
        free.hold.required_force_N,
        tuple(free.envelopes_mm.tolist()),
        tuple(free.finger_length_min_mm.tolist()),
    )


def _widest(constraints: Iterable[GraspConstraint]) -> list[GraspConstraint]:
    """The constraints without those that are stricter than another one of the same class and width."""
    kept: dict[tuple[str, float], list[GraspConstraint]] = {}
    for one in sorted(constraints, key=_strictness):
        rivals = kept.setdefault((one.gripper_type, one.opening_width_mm), [])
        if not any(
            other.finger_length_min_mm <= one.finger_length_min_mm
            and other.finger_length_max_mm >= one.finger_length_max_mm
            and other.release_clearance_mm <= one.release_clearance_mm
            for other in rivals
        ):
            rivals.append(one)
    return [one for rivals in kept.values() for one in rivals]


def _strictness(one: GraspConstraint) -> tuple[str, float, float, float, float]:
    length_min, length_max = one.finger_length_min_mm, one.finger_length_max_mm
    return one.gripper_type, one.opening_width_mm, length_min, -length_max, one.release_clearance_mm
