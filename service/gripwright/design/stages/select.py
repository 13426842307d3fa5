"""From what can be held to the smallest set of grippers: actuator, opening range, finger length and handles of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from gripwright.design import catalogue
from gripwright.design.actuation import ActuatorClass
from gripwright.design.demand import Demand, Offer, SelectOptions, demand_of, offer_of
from gripwright.design.handles import HeldGrasp, best_handle, fewest_changes, free_grasps
from gripwright.design.not_chosen import Offers, not_chosen, total_cost
from gripwright.design.plan import Plan
from gripwright.design.shortfall import without_actuator, without_grasp
from gripwright.design.toolbox import Toolbox
from gripwright.domain.assembly import AssemblyTask
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import OperationVerdict
from gripwright.domain.gripper import Actuator, Gripper, GripperParameters
from gripwright.domain.gripper_set import ComponentAlternatives, GripperSet, GripperSetProblem
from gripwright.plugin_api import RunContext


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
    offer = offer_of([held for group in grasps.values() for held in group], actuators, options, toolbox)
    demands = {operation: demand_of(group, offer, options) for operation, group in grasps.items()}
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


def _offers(actuators: Sequence[Actuator], offer: Offer, demands: Mapping[str, Demand], options: SelectOptions) -> Offers:
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


def _owned_that_hold(demand: Demand, offer: Offer, options: SelectOptions) -> tuple[str, ...]:
    return tuple(
        options.owned[i].id
        for i, parameters in zip(offer.owned.values(), _owned(offer, options), strict=True)
        if any(parameters.satisfies(one, options.release_clearance_mm) for one in demand.constraints)
    )


def _problem(demands: Mapping[str, Demand], offer: Offer, options: SelectOptions) -> GripperSetProblem:
    return GripperSetProblem(
        classes={key: kind.gripper_class for key, kind in offer.classes.items() if key not in offer.owned},
        components=tuple(ComponentAlternatives(id=op, alternatives=demand.constraints) for op, demand in demands.items()),
        release_clearance_mm=options.release_clearance_mm,
        finger_length_step_mm=options.finger_length_step_mm,
        owned=_owned(offer, options),
        in_sequence=options.weigh_sequence,
    )


def _owned(offer: Offer, options: SelectOptions) -> tuple[GripperParameters, ...]:
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
    offer: Offer,
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
    demand: Demand,
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
