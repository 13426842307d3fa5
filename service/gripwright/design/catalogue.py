"""The catalogue of actuators: which may be chosen, and the figures that a maker does not state, by documented defaults."""

import math
from collections.abc import Sequence

import numpy as np

from gripwright.design.actuator_csv import actuators_from_csv
from gripwright.domain.errors import Fault, InvalidPlan, Rejection
from gripwright.domain.gripper import Actuator
from gripwright.domain.shape import FloatArray

__all__ = [
    "BODY_DENSITY_KG_M3",
    "FINGER_THICKNESS_MM",
    "PAPER_ACTUATORS",
    "actuator_envelope_mm",
    "actuators_from_csv",
    "body_size",
    "envelope_ladder",
    "finger_envelope_mm",
    "jaw_offset_mm",
    "mass_or_default_kg",
    "opening_reference_mm",
    "opening_within_mm",
    "palm_depth_mm",
    "palm_envelope_mm",
    "select",
    "unavailable",
    "why_not",
    "why_unusable",
]

PAPER_ACTUATORS = ("SMC/MHF2-12D2", "SMC/MHSL3-32D (as in paper)")
"""The two air chucks of the paper (section 6), strokes 48 and 8 mm."""

FINGER_THICKNESS_MM = 8.0
"""Radial extent of a stem, behind the gripping surface."""

BODY_DENSITY_KG_M3 = 2700.0
_BODY_DIAMETER_MM = 25.0  # of an actuator without mass, plus twice its stroke
_OPENING_OF_BODY = 0.75  # the jaws' references of an actuator that does not state them, open, over its body's diameter
_JAW_OF_BODY, _JAW_MIN_MM, _JAW_MAX_MM = 0.25, 10.0, 20.0  # radial extent of a finger's base beyond the jaw's reference
_BASE_ALLOWANCE_MM = 6.0  # radial extent of base and arm beyond the stem
_BASE_HEIGHT_MM = 20.0  # of base and offset arm, along z
_LADDER = (10.0, 12.5, 16.0, 20.0, 25.0, 31.5, 40.0, 50.0, 63.0, 80.0)  # Renard series R10


def why_not(actuator: Actuator) -> Rejection | None:
    """Why this actuator is never chosen by itself; None where it may be."""
    unusable = why_unusable(actuator)
    if unusable is not None:
        return unusable
    if actuator.confidence == "C":
        return Rejection("conflicting-figures", f"sources of {actuator.name} conflict: it is used only where it is named")
    return None


def why_unusable(actuator: Actuator) -> Rejection | None:
    """Why this actuator cannot be used even where it is named."""
    if actuator.stroke_mm <= 0.0 and actuator.closes:
        return Rejection("no-stroke", f"the change of opening of {actuator.name} is not known, or it has none")
    return None


def select(actuators: Sequence[Actuator], spec: str | Sequence[str]) -> tuple[Actuator, ...]:
    """The actuators that a plan may use: `all`, `paper` (the two air chucks of the paper), or names as maker/model.

    `all` leaves out what `why_not` explains. A name that is not in the catalogue, or not usable, is an InvalidPlan.
    """
    if spec == "all":
        return tuple(actuator for actuator in actuators if why_not(actuator) is None)
    names = PAPER_ACTUATORS if spec == "paper" else ((spec,) if isinstance(spec, str) else tuple(spec))
    known = {actuator.name: actuator for actuator in actuators}
    faults = []
    for i, name in enumerate(names):
        unusable = why_unusable(known[name]) if name in known else Rejection("unknown", f"no actuator {name} in the catalogue")
        if unusable is not None:
            faults.append(Fault(pointer=f"/options/actuators/{i}", message=unusable.detail))
    if faults or not names:
        raise InvalidPlan("; ".join(fault.message for fault in faults) or "no actuator is named", faults=tuple(faults))
    return tuple(known[name] for name in dict.fromkeys(names))


def unavailable(actuators: Sequence[Actuator], spec: str | Sequence[str]) -> dict[str, Rejection]:
    """By name the actuators that a plan does not use, and why."""
    usable = {actuator.name for actuator in select(actuators, spec)}
    not_named = Rejection("not-in-plan", "the plan's `actuators` do not name it")
    return {actuator.name: why_not(actuator) or not_named for actuator in actuators if actuator.name not in usable}


def body_size(actuator: Actuator) -> tuple[float, float]:
    """Diameter and length (mm) of a cylinder about the gripper's axis that holds the actuator's body.

    Where the maker's figures are not known: of a solid of 2700 kg/m³ with the actuator's mass, as long as wide; without a
    mass, 25 mm plus twice the stroke.
    """
    if actuator.mass_kg is not None and actuator.mass_kg > 0.0:
        volume_mm3 = actuator.mass_kg / BODY_DENSITY_KG_M3 * 1e9
        default_mm = (4.0 * volume_mm3 / math.pi) ** (1.0 / 3.0)
    else:
        default_mm = _BODY_DIAMETER_MM + 2.0 * actuator.stroke_mm
    diameter_mm = actuator.body_diameter_mm or default_mm
    return diameter_mm, actuator.body_length_mm or (default_mm if actuator.body_diameter_mm is None else diameter_mm)


def mass_or_default_kg(actuator: Actuator) -> float:
    """The maker's mass, or that of a solid of 2700 kg/m³ of the body's size."""
    if actuator.mass_kg is not None:
        return actuator.mass_kg
    diameter_mm, length_mm = body_size(actuator)
    return math.pi / 4.0 * diameter_mm**2 * length_mm * BODY_DENSITY_KG_M3 * 1e-9


def opening_reference_mm(actuator: Actuator) -> float:
    """Distance of the jaws' own references, fully open: the maker's, or ¾ of the body's diameter, at least the stroke."""
    if actuator.opening_max_mm is not None:
        return actuator.opening_max_mm
    return max(actuator.stroke_mm, _OPENING_OF_BODY * body_size(actuator)[0])


def jaw_offset_mm(actuator: Actuator, opening_max_mm: float) -> float:
    """How far the gripping surface stands outside the jaws' reference when the actuator is fully open (INTERFACE.md)."""
    return (opening_max_mm - opening_reference_mm(actuator)) / 2.0 if actuator.closes else 0.0


def actuator_envelope_mm(actuator: Actuator) -> float:
    """Radius about the gripper's axis that the body and the fingers' bases on the open jaws need, whatever the fingers."""
    diameter_mm = body_size(actuator)[0]
    if not actuator.closes:
        return diameter_mm / 2.0
    jaw_mm = min(max(_JAW_OF_BODY * diameter_mm, _JAW_MIN_MM), _JAW_MAX_MM)
    return max(diameter_mm / 2.0, opening_reference_mm(actuator) / 2.0 + jaw_mm)


def finger_envelope_mm(opening_max_mm: float, finger_thickness_mm: float = FINGER_THICKNESS_MM) -> float:
    """Radius about the gripper's axis that the fingers need behind their stems, open at `opening_max_mm`."""
    return opening_max_mm / 2.0 + finger_thickness_mm + _BASE_ALLOWANCE_MM


def opening_within_mm(envelope_mm: float, finger_thickness_mm: float = FINGER_THICKNESS_MM) -> float:
    """The largest opening at which the fingers stay within a palm envelope."""
    return 2.0 * (envelope_mm - finger_thickness_mm - _BASE_ALLOWANCE_MM)


def palm_envelope_mm(actuator: Actuator, opening_max_mm: float, finger_thickness_mm: float = FINGER_THICKNESS_MM) -> float:
    """Radius about the gripper's axis within which bases, offset arms and body lie, open at `opening_max_mm`.

    It grows with the opening. A gripper that holds width W with a stroke d opens to W + d at most. Without jaws it is the body's:
    a cup may be wider than what carries it.
    """
    if not actuator.closes:
        return actuator_envelope_mm(actuator)
    return max(actuator_envelope_mm(actuator), finger_envelope_mm(opening_max_mm, finger_thickness_mm))


def palm_depth_mm(actuator: Actuator) -> float:
    """How far bases, offset arms and body reach back from z = −L."""
    return body_size(actuator)[1] + _BASE_HEIGHT_MM


def envelope_ladder(max_mm: float) -> FloatArray:
    """Palm envelopes to plan for, ascending: 16, 20, 25, 31.5, 40, … mm, the last one at least `max_mm`."""
    rungs = [_LADDER[2]]
    decade, step = 1.0, 3
    while rungs[-1] < max_mm:
        rungs.append(_LADDER[step] * decade)
        step += 1
        if step == len(_LADDER):
            decade, step = decade * 10.0, 0
    return np.array(rungs)
