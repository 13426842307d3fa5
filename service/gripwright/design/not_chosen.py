"""Why a gripper of the set has the actuator that it has: for each of the others what speaks against it, and what it costs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gripwright.design.actuation import ActuatorClass, Shortfall
from gripwright.design.catalogue import mass_or_default_kg
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import INTERNAL, GraspConstraint
from gripwright.domain.grasp import clearance_mm as clearance_of
from gripwright.domain.gripper import BOUND_TOLERANCE_MM as SLACK
from gripwright.domain.gripper import Actuator, Gripper
from gripwright.domain.preference import Preference

ActuatorGrip = tuple[str, str]
"""Name of an actuator, and a grip."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Offers:
    """What the actuators at hand can do in each operation."""

    actuators: Sequence[Actuator]
    classes: Mapping[str, ActuatorClass]
    outdone: Mapping[ActuatorGrip, Rejection]
    constraints: Mapping[str, Sequence[GraspConstraint]]  # by operation
    shortfalls: Mapping[str, Mapping[ActuatorGrip, Shortfall]]  # by operation, the closest
    costs: Mapping[str, float]  # by actuator
    preferences: Mapping[str, Sequence[Preference]]  # by actuator
    enforce_hold: bool
    release_clearance_mm: float

    @property
    def priced(self) -> bool:
        """Whether costs are prices; else they are masses."""
        return all(actuator.price is not None for actuator in self.actuators)


def not_chosen(gripper: Gripper, offers: Offers) -> dict[str, Rejection]:
    """For each actuator that the gripper does not have, by name, why not."""
    return {
        actuator.name: _reason(actuator, gripper, offers)
        for actuator in offers.actuators
        if actuator.name != gripper.actuator.name
    }


def total_cost(bought: Sequence[Actuator], offers: Offers) -> dict[str, Any]:
    """What actuators cost, as JSON, and in what: prices where all on offer have one, else masses in kg."""
    sums = [actuator.price if offers.priced else mass_or_default_kg(actuator) for actuator in bought]
    return {
        "basis": "price" if offers.priced else "mass",
        "sum": round(sum(figure for figure in sums if figure is not None), 6),
        "unknown_forces": sum(actuator.grip_force_N is None for actuator in bought),
    }


def _reason(actuator: Actuator, gripper: Gripper, offers: Offers) -> Rejection:
    if actuator.gripper_type != gripper.gripper_type:
        return Rejection("other-type", f"is {actuator.gripper_type}, the grasps are {gripper.gripper_type}")
    if (actuator.name, gripper.grip) in offers.outdone:
        return offers.outdone[actuator.name, gripper.grip]
    operations = [handle.operation for handle in gripper.handles]
    wanted = (actuator, gripper.grip, gripper.taper_rad, gripper.vee)
    classes = {
        key: kind for key, kind in offers.classes.items() if (kind.actuator, kind.grip, kind.taper_rad, kind.vee) == wanted
    }
    for operation in operations:
        if not any(one.gripper_type in classes for one in offers.constraints[operation]):
            short = offers.shortfalls[operation].get((actuator.name, gripper.grip))
            if short is None:
                return Rejection("no-grasp", f"no grasp of {operation} is of its type")
            return Rejection(short.code, f"cannot serve {operation}: {short.detail}")
    if not any(_holds_all(key, kind, operations, offers) for key, kind in classes.items()):
        return Rejection(
            "range-too-short",
            f"serves each of {len(operations)} operations, but all together with no single opening range and finger length "
            f"(stroke {actuator.stroke_mm:g} mm)",
        )
    return _dearer(actuator, gripper.actuator, offers)


def _dearer(actuator: Actuator, chosen: Actuator, offers: Offers) -> Rejection:
    if offers.costs[actuator.name] <= offers.costs[chosen.name]:
        return Rejection("no-better", "would do as well; tool changes, then finger lengths decide")
    if offers.enforce_hold and actuator.grip_force_N is None and chosen.grip_force_N is not None:
        return Rejection("unknown-force", f"its grip force is not known, that of {chosen.name} is")
    weighed = "".join(
        f"; {one.name} by {preference}" for one in (actuator, chosen) for preference in offers.preferences.get(one.name, ())
    )
    if offers.priced:
        return Rejection("dearer", f"price {actuator.price:g}, that of {chosen.name} {chosen.price:g}{weighed}")
    masses = [
        f"{mass_or_default_kg(one):.3g} kg{'' if one.mass_kg is not None else ' (estimated)'}" for one in (actuator, chosen)
    ]
    return Rejection("heavier", f"{masses[0]}, {chosen.name} {masses[1]}; prices are not known of all actuators{weighed}")


def _holds_all(key: str, kind: ActuatorClass, operations: Sequence[str], offers: Offers) -> bool:
    """Whether one gripper of a class can hold all operations (Eq. (2) of the paper, at the critical values)."""
    rows = [
        (
            index,
            one.opening_width_mm,
            clearance_of(kind.grip, one.release_clearance_mm, offers.release_clearance_mm),
            *_lengths(one),
        )
        for index, operation in enumerate(operations)
        for one in offers.constraints[operation]
        if one.gripper_type == key
    ]
    if {row[0] for row in rows} != set(range(len(operations))):
        return False
    operation, width_mm, clearance_mm, low_mm, high_mm = np.array(rows, dtype=np.float64).T  # (n,)
    outwards = -width_mm if kind.grip == INTERNAL else width_mm
    for reach_mm in np.unique(outwards + clearance_mm):
        within = (outwards + clearance_mm <= reach_mm + SLACK) & (reach_mm <= outwards + kind.actuator.stroke_mm + SLACK)
        if len(np.unique(operation[within])) < len(operations):
            continue
        for length_mm in np.unique(low_mm[within]):
            held = within & (low_mm <= length_mm + SLACK) & (length_mm <= high_mm + SLACK)
            if len(np.unique(operation[held])) == len(operations):
                return True
    return False


def _lengths(one: GraspConstraint) -> tuple[float, float]:
    return one.finger_length_min_mm, one.finger_length_max_mm
