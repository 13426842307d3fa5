"""What a finger's drawing says of its gripping surface and its pad."""

import math

from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.grasp import INTERNAL
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import VTip
from gripwright.report.dimension import millimetres


def gripping_surface_notes(cad: GripperCad) -> list[str]:
    """What touches the component, and how its edges are."""
    nose = cad.finger.properties.get("nose_radius_mm")
    if nose is not None:
        return [
            f"Gripping surface: the stem's round side R{millimetres(nose)} away from the gripper's axis,",
            "tangent to x = 0; whole up to the tip, its edges broken by 0.2 at most.",
        ]
    if (groove := cad.finger.properties.get("groove_radius_mm")) is not None:
        return [
            f"Gripping surface: hollow R{millimetres(groove)} over the whole stem, its corners at",
            "x = 0, towards the gripper's axis; edges broken by 0.2 at most.",
        ]
    if cad.spec.vee is not None:
        return _v_notes(VTip(vee=cad.spec.vee, taper_rad=cad.spec.taper_rad))
    if cad.spec.taper_rad:
        taper, where = Taper(angle_rad=cad.spec.taper_rad), "end" if cad.spec.taper_rad > 0.0 else "shoulder"
        return [
            f"Gripping surface: plane, inclined by {abs(math.degrees(taper.angle_rad)):.1f}° to z over "
            f"{millimetres(taper.height_mm)} from the tip's end,",
            f"nearest to the gripper's axis at its {where}, there x = 0; its edges broken by 0.2 at most.",
        ]
    side = "away from" if cad.spec.grip == INTERNAL else "towards"
    part = "stem" if cad.finger.bonded is None else "pad"
    return [
        f"Gripping surface: the {part}'s face {side} the gripper's axis, x = 0;",
        "flat over the whole stem, its edges broken by 0.2 at most.",
    ]


def bonding_notes(cad: GripperCad) -> list[str]:
    """The pad and how it is bonded; nothing where there is none."""
    bonded = cad.finger.bonded
    if bonded is None:
        return []
    thickness, width, length = (millimetres(side) for side in bonded.pad_size_mm)
    return [
        f"Pad: {bonded.pad.material}, {thickness} × {width} × {length}{_folded(cad)}; bond it over its whole face,",
        f"flush with tip and sides, with {bonded.adhesive}.",
        f"Seat of the pad: degreased, its corner to the {'shoulder' if _has_shoulder(cad) else 'base'} R0.3 at most.",
        *(["Pad bevelled at both ends."] if cad.spec.taper_rad else []),
        f"Holes are measured from {'x = 0' if _has_shoulder(cad) else 'the seat'}. Without pad: finger_bare.step.",
    ]


def _v_notes(tip: VTip) -> list[str]:
    """The V, its taper, and which of its edges is nearest to the gripper's axis."""
    where = {0: "all along", 1: "at the tip's end", -1: "at the shoulder"}[(tip.taper_rad > 0.0) - (tip.taper_rad < 0.0)]
    tilt = math.degrees(tip.incline_rad), abs(math.degrees(tip.taper_rad))
    inclined = (
        [f"along it inclined by {tilt[0]:.1f}° to z, as a cone of half angle {tilt[1]:.1f}° asks;"] if tip.taper_rad else []
    )
    return [
        f"Gripping surface: V of {tip.vee.degrees:.1f}°, {millimetres(tip.vee.depth_mm)} deep in every section along z, over "
        f"{millimetres(tip.height_mm)},",
        *inclined,
        f"its edges at x = 0 {where}, broken by 0.2 at most.",
    ]


def _has_shoulder(cad: GripperCad) -> bool:
    """Whether the pad ends at a shoulder, and lies askew."""
    return bool(cad.spec.taper_rad) or cad.spec.vee is not None


def _folded(cad: GripperCad) -> str:
    return ", folded" if cad.spec.vee is not None else ""
