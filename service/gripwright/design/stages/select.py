"""From what can be held to the smallest set of grippers: actuator, opening range, finger length and handles of each."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from gripwright.design import catalogue
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
from gripwright.design.handles import HeldGrasp, best_handle, fewest_changes, free_grasps
from gripwright.design.not_chosen import ActuatorGrip, Offers, not_chosen, total_cost
from gripwright.design.plan import Plan
from gripwright.design.shortfall import closest, without_actuator, without_grasp
from gripwright.design.tapered_hand import tapered
from gripwright.design.toolbox import Toolbox
from gripwright.domain.assembly import AssemblyTask
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import FreeGrasp, GraspConstraint, OperationVerdict
from gripwright.domain.gripper import Actuator, Gripper, GripperParameters
from gripwright.domain.gripper_set import ComponentAlternatives, GripperSet, GripperSetProblem
from gripwright.domain.preference import Preference
from gripwright.plugin_api import RunContext


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
class Selection:
    """The gripper set, and what it leaves open."""

    grippers: tuple[Gripper, ...]
    optimum: dict[str, Any]  # JSON: grippers, lower_bound, proven, candidates, objectives, …
    not_covered: dict[str, str]  # operation → one sentence
    not_chosen: dict[str, dict[str, Rejection]]  # new gripper → actuator that it does not have → why not
    owned: dict[str, str] = field(default_factory=dict)  # gripper of the set → gripper of `SelectOptions.owned`
    owned_that_hold: dict[str, tuple[str, ...]] = field(default_factory=dict)  # operation → all owned that could hold it
    remarks: dict[str, tuple[str, ...]] = field(default_factory=dict)  # gripper → what the house's policies prefer of it


def options_of(plan: Plan) -> SelectOptions:
    """The plan's options. The paper's own method knows neither force nor cost nor sequence."""
    return SelectOptions(
        release_clearance_mm=plan.release_clearance,
        finger_length_step_mm=plan.finger_length_step,
        safety_factor=plan.safety_factor,
        enforce_hold=plan.enforce_hold,
        weigh_sequence=plan.plan != "paper",
    )


def select(
    task: AssemblyTask,
    verdicts: Sequence[OperationVerdict],
    actuators: Sequence[Actuator],
    options: SelectOptions,
    toolbox: Toolbox,
    ctx: RunContext,
) -> Selection:
    """The smallest set of grippers for the operations that some grasp holds, and a reason for each of the others."""
    sequence = {operation.id: i for i, operation in enumerate(task.operations)}
    verdicts = sorted(verdicts, key=lambda verdict: sequence[verdict.operation])
    grasps = {verdict.operation: free_grasps(verdict) for verdict in verdicts}
    offer = _offer([held for group in grasps.values() for held in group], actuators, options, toolbox)
    demands = {operation: _demand(group, offer, options) for operation, group in grasps.items()}
    solution = toolbox.optimizer.solve(_problem(demands, offer, options), ctx)
    chosen = sorted(solution.grippers, key=lambda gripper: _order(gripper.parameters, offer.classes))
    able = {operation: frozenset(i for i, gripper in enumerate(chosen) if operation in gripper.holds) for operation in grasps}
    assigned = fewest_changes({operation: indices for operation, indices in able.items() if indices})
    grippers = tuple(
        _gripper(f"G{i + 1}", gripper.parameters, offer, [op for op, index in assigned.items() if index == i], grasps, options)
        for i, gripper in enumerate(chosen)
    )
    owned = {
        gripper.id: options.owned[offer.owned[source.parameters.gripper_type]].id
        for gripper, source in zip(grippers, chosen, strict=True)
        if source.owned
    }
    offers = _offers(actuators, offer, demands, options)
    return Selection(
        grippers=grippers,
        optimum={
            **_optimum(solution, list(assigned.values())),
            "cost": total_cost([g.actuator for g in grippers if g.id not in owned], offers),
        },
        not_covered={
            verdict.operation: _shortfall(verdict, demands[verdict.operation], actuators, options.refused)
            for verdict in verdicts
            if verdict.operation in solution.uncoverable
        },
        not_chosen={gripper.id: not_chosen(gripper, offers) for gripper in grippers if gripper.id not in owned},
        owned=owned,
        owned_that_hold={operation: _owned_that_hold(demand, offer, options) for operation, demand in demands.items()},
        remarks={gripper.id: _remarks(gripper, options) for gripper in grippers},
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Offer:
    """What can be chosen: classes of actuators by key, those of owned grippers among them, and the actuators outdone."""

    classes: dict[str, ActuatorClass]
    owned: dict[str, int]  # key of a class → index of the owned gripper
    outdone: dict[ActuatorGrip, Rejection]
    costs: dict[str, float]  # by actuator name
    policy: HoldPolicy


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Demand:
    """What one operation asks of the grippers: one of the constraints, and what failed in the other classes."""

    constraints: tuple[GraspConstraint, ...]
    shortfalls: dict[ActuatorGrip, Shortfall]  # the closest


def _offer(grasps: Sequence[HeldGrasp], actuators: Sequence[Actuator], options: SelectOptions, toolbox: Toolbox) -> _Offer:
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
    return _Offer(classes=classes, owned=owned, outdone=worse, costs=costs, policy=policy)


def _fingers(free: FreeGrasp) -> tuple[str, str, float, float, float]:
    """What a grasp asks of fingers: grippers of other fingers are of other classes."""
    grasp, vee = free.grasp, free.grasp.vee
    v = (0.0, 0.0) if vee is None else (vee.angle_rad, vee.depth_mm)
    return grasp.gripper_type, grasp.grip, grasp.taper_rad, *v


def _demand(grasps: Sequence[HeldGrasp], offer: _Offer, options: SelectOptions) -> _Demand:
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
    return _Demand(
        constraints=tuple(_widest(constraints)), shortfalls={which: closest(found) for which, found in shortfalls.items()}
    )


def _offers(actuators: Sequence[Actuator], offer: _Offer, demands: Mapping[str, _Demand], options: SelectOptions) -> Offers:
    return Offers(
        actuators=actuators,
        classes={key: kind for key, kind in offer.classes.items() if key not in offer.owned},
        outdone=offer.outdone,
        constraints={operation: demand.constraints for operation, demand in demands.items()},
        shortfalls={operation: demand.shortfalls for operation, demand in demands.items()},
        costs=offer.costs,
        preferences=options.preferences,
        enforce_hold=options.enforce_hold,
        release_clearance_mm=options.release_clearance_mm,
    )


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


def _owned_that_hold(demand: _Demand, offer: _Offer, options: SelectOptions) -> tuple[str, ...]:
    return tuple(
        options.owned[i].id
        for i, parameters in zip(offer.owned.values(), _owned(offer, options), strict=True)
        if any(parameters.satisfies(one, options.release_clearance_mm) for one in demand.constraints)
    )


def _problem(demands: Mapping[str, _Demand], offer: _Offer, options: SelectOptions) -> GripperSetProblem:
    return GripperSetProblem(
        classes={key: kind.gripper_class for key, kind in offer.classes.items() if key not in offer.owned},
        components=tuple(ComponentAlternatives(id=op, alternatives=demand.constraints) for op, demand in demands.items()),
        release_clearance_mm=options.release_clearance_mm,
        finger_length_step_mm=options.finger_length_step_mm,
        owned=_owned(offer, options),
        in_sequence=options.weigh_sequence,
    )


def _owned(offer: _Offer, options: SelectOptions) -> tuple[GripperParameters, ...]:
    return tuple(
        GripperParameters(
            gripper_type=key,
            opening_min_mm=options.owned[i].opening_min_mm,
            opening_max_mm=options.owned[i].opening_max_mm,
            finger_length_mm=options.owned[i].finger_length_mm,
            grip=options.owned[i].grip,
        )
        for key, i in offer.owned.items()
    )


def _gripper(
    gripper_id: str,
    parameters: GripperParameters,
    offer: _Offer,
    operations: Sequence[str],
    grasps: Mapping[str, Sequence[HeldGrasp]],
    options: SelectOptions,
) -> Gripper:
    kind = offer.classes[parameters.gripper_type]
    return Gripper(
        id=gripper_id,
        gripper_type=kind.actuator.gripper_type,
        fingers=kind.fingers,
        grip=kind.grip,
        opening_min_mm=parameters.opening_min_mm,
        opening_max_mm=parameters.opening_max_mm,
        finger_length_mm=parameters.finger_length_mm,
        actuator=kind.actuator,
        jaw_offset_mm=catalogue.jaw_offset_mm(kind.actuator, parameters.opening_max_mm),
        envelope_mm=kind.envelope_mm,
        taper_rad=kind.taper_rad,
        vee=kind.vee,
        handles=tuple(
            best_handle(op, grasps[op], parameters, kind, options.release_clearance_mm, offer.policy) for op in operations
        ),
    )


def _order(parameters: GripperParameters, classes: Mapping[str, ActuatorClass]) -> tuple[str, str, float, float, str]:
    kind = classes[parameters.gripper_type]
    return kind.actuator.gripper_type, kind.grip, parameters.opening_max_mm, parameters.finger_length_mm, kind.key


def _optimum(solution: GripperSet, assigned: Sequence[int]) -> dict[str, Any]:
    return {
        "grippers": len(solution.grippers),
        "new": sum(not gripper.owned for gripper in solution.grippers),
        "lower_bound": solution.lower_bound,
        "proven": solution.proven,
        "candidates": solution.candidates,
        "tool_changes": sum(a != b for a, b in pairwise(assigned)),
        "objectives": dict(solution.detail),
    }


def _remarks(gripper: Gripper, options: SelectOptions) -> tuple[str, ...]:
    """What the house prefers of a gripper's actuator and of its grasps."""
    bought = [f"{gripper.actuator.name}: {preference}" for preference in options.preferences.get(gripper.actuator.name, ())]
    held = [
        f"{handle.operation}, segment {handle.segment} of {handle.component}: {preference}"
        for handle in gripper.handles
        for preference in handle.preferences
    ]
    return (*bought, *held)


def _shortfall(
    verdict: OperationVerdict,
    demand: _Demand,
    actuators: Sequence[Actuator],
    refused: Sequence[tuple[Actuator, Rejection]],
) -> str:
    gripper_types = {held.free.grasp.gripper_type for held in free_grasps(verdict)}
    asked = {item.requirement.gripper_type for found in verdict.components.values() for item in found if item.requirement}
    wanted = gripper_types or asked - {actuator.gripper_type for actuator in actuators}
    house = [f"{actuator.name}, {why.detail}" for actuator, why in refused if actuator.gripper_type in wanted]
    told = f"; the house refuses {len(house)} of the type: {house[0]}" if house else ""
    if not gripper_types:
        return without_grasp(verdict) + told
    return without_actuator(verdict, gripper_types, demand.shortfalls.values()) + told
