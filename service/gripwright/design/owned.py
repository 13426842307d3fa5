"""Grippers that are at hand already: as a plan states them, and as the selection takes them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gripwright.design import catalogue
from gripwright.design.miss_document import vee_of_document
from gripwright.design.plan import OwnedGripper
from gripwright.domain.errors import Fault, InvalidPlan
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import NO_STROKE, Actuator, Gripper
from gripwright.plugin_api import HandModel

_STATED_MM = 4.9e-5
"""Added to both ends of an opening range: design documents round to 0.0001 mm. A little less than half: it rounds back."""


def actuators_of(owned: Sequence[OwnedGripper], actuators: Sequence[Actuator]) -> tuple[Actuator, ...]:
    """The actuator of each owned gripper; InvalidPlan names each that is not in the catalogue or does not open so far."""
    known = {actuator.name: actuator for actuator in actuators}
    faults, found = [], []
    for i, gripper in enumerate(owned):
        actuator = known.get(gripper.actuator) if gripper.actuator is not None else _unnamed(gripper)
        if actuator is None:
            fault = Fault(f"/options/owned/{i}/actuator", f"no actuator {gripper.actuator} in the catalogue")
        elif (range_mm := gripper.opening_max - gripper.opening_min) > actuator.stroke_mm + 2.0 * _STATED_MM:
            message = f"the opening changes by {range_mm:g} mm, the stroke of {actuator.name} is {actuator.stroke_mm:g} mm"
            fault = Fault(f"/options/owned/{i}/opening_max", message)
        else:
            found.append(actuator)
            continue
        faults.append(fault)
    if faults:
        raise InvalidPlan("; ".join(fault.message for fault in faults), faults=tuple(faults))
    return tuple(found)


def owned_grippers(
    owned: Sequence[OwnedGripper], actuators: Sequence[Actuator], hands: Mapping[str, HandModel]
) -> tuple[Gripper, ...]:
    """The owned grippers with their hands and the catalogue's figures; InvalidPlan names each that has no hand model."""
    faults = tuple(
        Fault(
            f"/options/owned/{i}/gripper_type", f"no hand model of the type {gripper.gripper_type!r}: {', '.join(sorted(hands))}"
        )
        for i, gripper in enumerate(owned)
        if gripper.gripper_type not in hands
    )
    if faults:
        raise InvalidPlan("; ".join(fault.message for fault in faults), faults=faults)
    return tuple(
        _gripper(gripper, actuator, hands[gripper.gripper_type])
        for gripper, actuator in zip(owned, actuators_of(owned, actuators), strict=True)
    )


def specifications(design: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The grippers of a design document as those that are owned from then on; owned ones keep their names.

    InvalidPlan names those with concave tips: the hand model of an owned gripper is flat.
    """
    product = design["product"]
    hollow = [gripper["id"] for gripper in design["grippers"] if "groove_radius_mm" in (gripper.get("finger") or {})]
    if hollow:
        listed = ", ".join(hollow)
        raise InvalidPlan(f"grippers with concave tips cannot be taken over as owned, their hand model is flat: {listed}")
    return [
        {
            "name": gripper["owned"] or f"{product['part_number']}-{product['revision']}-{gripper['id']}",
            **{key: gripper[key] for key in ("gripper_type", "grip", "opening_min", "opening_max", "finger_length")},
            "actuator": f"{gripper['actuator']['maker']}/{gripper['actuator']['model']}"
            if gripper["actuator"]["maker"]
            else None,
            "palm_radius": gripper["palm_radius"],
            **{key: gripper[key] for key in ("taper", "v_angle", "v_depth") if key in gripper},
        }
        for gripper in design["grippers"]
    ]


def _gripper(owned: OwnedGripper, actuator: Actuator, hand: HandModel) -> Gripper:
    default_mm = catalogue.palm_envelope_mm(actuator, owned.opening_max)
    return Gripper(
        id=owned.name,
        gripper_type=owned.gripper_type,
        fingers=hand.fingers,
        grip=owned.grip,
        opening_min_mm=max(owned.opening_min - _STATED_MM, 0.0),
        opening_max_mm=owned.opening_max + _STATED_MM,
        finger_length_mm=owned.finger_length,
        actuator=actuator,
        jaw_offset_mm=catalogue.jaw_offset_mm(actuator, owned.opening_max),
        envelope_mm=default_mm if owned.palm_radius is None else owned.palm_radius,
        taper_rad=math.radians(owned.taper),
        vee=vee_of_document(owned.model_dump()),
        handles=(),
    )


def _unnamed(owned: OwnedGripper) -> Actuator:
    """What is known of the actuator of an owned gripper that names none."""
    stroke_mm = owned.opening_max - owned.opening_min
    basis = NO_STROKE if owned.grip == SURFACE else "total"
    return Actuator(maker="", model=owned.name, gripper_type=owned.gripper_type, stroke_mm=stroke_mm, stroke_basis=basis)
