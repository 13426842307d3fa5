"""A nearest miss in one sentence, as a mechanical engineer would say it: how it was held, what is in the way, where, how much."""

from itertools import pairwise

import numpy as np

from gripwright.design.hand_check import LENGTH_LIMIT_MM, OperationScene
from gripwright.design.hand_volumes import CLOSING, LEAVING, MOTION, OPENING, TAKING_UP
from gripwright.design.motion import stretches
from gripwright.design.nearest_miss import Closest
from gripwright.domain.grasp import CENTRIC_3, INTERNAL, SURFACE, Grasp, GripRequirement, NearestMiss
from gripwright.domain.shape import Cylinder
from gripwright.domain.v_tip import Vee

_TOUCHING_MM = 0.005
_SEATED_MM = 0.5  # from here on it is at its seat
_STEEP = 0.9
_WHOLE = {"outer face": "thickness", "gripping face": "thickness", "side": "width", "rim": "width", "tip": "length"}


def nearest_miss(closest: Closest, segment: int, held: str, scene: OperationScene) -> NearestMiss:
    """What design.json says of the grasp that came closest."""
    shortage, grasp = closest.shortage, closest.grasp
    return NearestMiss(
        code=shortage.code,
        quantity=shortage.quantity,
        found=shortage.found,
        limit=shortage.limit,
        amount=shortage.amount,
        unit=shortage.unit,
        sentence=f"{held_at(closest.requirement, segment)} {_what(closest, held, scene)}",
        gripper_type=grasp.gripper_type,
        grip=grasp.grip,
        opening_width_mm=grasp.opening_width_mm,
        grasp=grasp,
        finger_length_mm=closest.finger_length_mm,
        palm_radius_mm=closest.palm_radius_mm,
        part=shortage.part,
        side=shortage.side,
        hit=shortage.hit,
        phase=shortage.phase,
        place=closest.place,
        point_P=closest.point_P,
    )


def narrow_bore(requirement: GripRequirement, segment: int, fingers: int, least_mm: float) -> NearestMiss:
    """A bore that the fingers do not fit into, however they are put."""
    width = requirement.opening_width_mm
    return NearestMiss(
        code="too-narrow",
        quantity="opening",
        found=width,
        limit=least_mm,
        amount=least_mm - width,
        unit="mm",
        sentence=(
            f"{held_at(requirement, segment)} the bore is too narrow for {fingers} fingers by {mm(least_mm - width)}: "
            f"closed to let go they need {mm(least_mm)}"
        ),
        gripper_type=requirement.gripper_type,
        grip=requirement.grip,
        opening_width_mm=width,
    )


def held_at(requirement: GripRequirement, segment: int) -> str:
    """Where a requirement holds: "gripped on Ø24.0 mm (segment 2),"."""
    is_round = requirement.grip == INTERNAL or isinstance(requirement.primitive, Cylinder)
    return _gripped(requirement.opening_width_mm, requirement.grip, is_round, requirement.vee, segment)


def held_with(grasp: Grasp, segment: int) -> str:
    """As `held_at`, of a grasp by itself: three fingers hold round surfaces."""
    return _gripped(grasp.opening_width_mm, grasp.grip, grasp.gripper_type == CENTRIC_3, grasp.vee, segment)


def _gripped(opening_width_mm: float, grip: str, is_round: bool, vee: Vee | None, segment: int) -> str:
    if grip == SURFACE:
        return f"held by a face of Ø{opening_width_mm:.1f} mm (segment {segment}),"
    if vee is not None:
        return f"gripped by V tips {opening_width_mm:.1f} mm apart (segment {segment}),"
    where = "across " if not is_round else "from inside Ø" if grip == INTERNAL else "on Ø"
    return f"gripped {where}{opening_width_mm:.1f} mm (segment {segment}),"


def _what(closest: Closest, held: str, scene: OperationScene) -> str:
    shortage = closest.shortage
    match shortage.quantity:
        case "clearance":
            return f"{_collision(closest, held)} {_when(closest, scene)}".rstrip()
        case "contact height" if shortage.found <= 0.0:
            return f"{shortage.part} would touch nothing"
        case "contact height":
            return (
                f"{shortage.part} would touch along {mm(shortage.found)} of its height only, "
                f"at least {mm(shortage.limit)} is required"
            )
        case "surface gap":
            return (
                f"{shortage.part} would stay {shortage.found:.3f} mm off the surface while another one touches, "
                f"at most {shortage.limit:.3f} mm is allowed"
            )
        case "forbidden surface":
            return f"{shortage.part} would reach {mm(shortage.amount)} over {shortage.words}, which must not be touched"
        case "opening":
            return f"no actuator at hand is of the type {shortage.words}"
        case "hold":
            return shortage.words
    return (
        f"no grip force would hold it: the fingers slip off at a coefficient of friction of {shortage.found:g}, "
        f"{shortage.limit:.2f} is needed"
    )


def _collision(closest: Closest, held: str) -> str:
    shortage = closest.shortage
    body = "the component itself" if shortage.hit == held else f"'{shortage.hit}'"
    part = shortage.part or ""
    if closest.grasp.grip == SURFACE and part.startswith("finger"):
        part = "what holds it"
    if part == "the palm":
        behind = "a stem" if closest.grasp.grip == SURFACE else "fingers"
        part = f"the palm (radius {closest.palm_radius_mm:.0f} mm), even behind {behind} of {LENGTH_LIMIT_MM:.0f} mm,"
    if shortage.intrusion is not None and shortage.intrusion.whole and shortage.side in _WHOLE:
        size_mm = min(-shortage.found, shortage.intrusion.size_mm)
        return f"{part} would run into {body} with its whole {_WHOLE[shortage.side]} of {mm(size_mm)},"
    required = f" ({mm(shortage.limit)} of clearance is required)" if shortage.limit > 0.0 else ""
    if shortage.found > _TOUCHING_MM:
        return f"{part} would come within {mm(shortage.found)} of {body}{required} with its {shortage.side},"
    if shortage.found > -_TOUCHING_MM:
        return f"{part} would touch {body}{required} with its {shortage.side},"
    return f"{part} would enter {body} by {mm(-shortage.found)}{required} with its {shortage.side},"


def _when(closest: Closest, scene: OperationScene) -> str:
    shortage = closest.shortage
    riding = shortage.hit in scene.attached.names
    match shortage.phase:
        case p if p == TAKING_UP:
            return "when the open gripper reaches for it" if riding else "when the open gripper takes it up"
        case p if p == CLOSING:
            return "while it closes"
        case p if p == OPENING:
            return f"while it opens by {mm(scene.release_clearance_mm)} to let go"
        case p if p == LEAVING:
            return "when the open gripper leaves it at its seat"
        case p if p == MOTION:
            return _on_the_way(closest.place, scene)
    return ""


def _on_the_way(place: float | None, scene: OperationScene) -> str:
    """Where on the motion, in words: straight motions in mm from the seat, others as a share."""
    if place is None:
        return "on its way"
    if place <= 0.0:
        return "from the start of its motion on"
    if any(stretch.arcs_rad.any() for stretch in stretches(scene.motion)):
        return f"while it turns in, from {100.0 * place:.0f} % of its motion on"
    legs = [end[:3, 3] - start[:3, 3] for start, end in pairwise(scene.motion)]
    left_mm = (1.0 - place) * sum(float(np.linalg.norm(leg)) for leg in legs)
    if left_mm < _SEATED_MM:
        return "as it reaches its seat"
    last = legs[-1] / max(float(np.linalg.norm(legs[-1])), 1e-12)
    way, side = ("down", "above") if last[2] < -_STEEP else ("up", "below") if last[2] > _STEEP else ("in", "before")
    return f"on the way {way}, from {mm(left_mm)} {side} its seat onwards"


def mm(value: float) -> str:
    """A length as a sentence says it."""
    return f"{value:.1f} mm" if value >= 10.0 else f"{value:.2f} mm"
