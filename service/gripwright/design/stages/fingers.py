"""Stage "fingers": the CAD of one gripper, its fingers on the actuator's jaws and the body behind them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gripwright.design import holder
from gripwright.design.gripper_assembly import BodyMeasures, body_shape, jaw_of, reach_mm
from gripwright.design.holder import Models
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import FingerDesign, FingerSpec, Gripper
from gripwright.domain.pad import Pad
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import SIDES, VTip
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.measures import face_areas_mm2
from gripwright.plugin_api import FingerDesigner, HandModel, RunContext, TaperedFingerDesigner, VTipDesigner

_TOLERANCE_MM = 0.02  # of a tessellated surface
_WHOLE = 0.95  # of a tapered gripping surface, of a flank of a V; its edges may be broken


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GripperCad:
    """One finger (frame F), the same at every place, and the body with its jaws (frame G)."""

    spec: FingerSpec
    finger: FingerDesign
    body_brep: bytes
    body: Mesh
    measures: BodyMeasures
    grip_force_max_N: float | None = None  # total; set where the fingers bear less than the actuator's full force


def design_gripper_cad(
    gripper: Gripper,
    designer: FingerDesigner,
    hand: HandModel,
    contact_radii_mm: Sequence[float],
    body_diameter_mm: float,
    body_length_mm: float,
    required_force_N: float,
    safety_factor: float,
    ctx: RunContext,
    models: Models | None = None,
) -> GripperCad | Rejection:
    """Fingers and body of a gripper, inside the hand and the palm envelope that the constraints assumed, or why not.

    Fingers are made for the actuator's full grip force; where none can bear it, for what the handles need (`required_force_N`)
    with the safety factor, and the force to which the actuator must be regulated is stated.
    """
    if gripper.taper_rad and not (isinstance(designer, TaperedFingerDesigner) and designer.tapers(gripper.taper_rad)):
        return Rejection("finger-not-tapered", f"the finger designer {designer.key!r} makes no tips of that taper")
    if gripper.vee and not (isinstance(designer, VTipDesigner) and designer.has_v(gripper.vee, gripper.taper_rad)):
        return Rejection("finger-without-v", f"the finger designer {designer.key!r} makes no tips with that V")
    needed = required_force_N * safety_factor
    full = holder.grip_force_N(gripper.actuator, gripper.opening_max_mm, models or {})
    forces = [needed] if full is None else [full, *([needed] if needed < full else [])]
    rejections: list[Rejection] = []
    for force in forces:
        spec = finger_spec(gripper, contact_radii_mm, force, ctx.pad)
        finger = designer.design(spec, ctx)
        if isinstance(finger, Rejection):
            rejections.append(finger)
            continue
        cad = _with_body(spec, finger, gripper, hand, body_diameter_mm, body_length_mm)
        if isinstance(cad, GripperCad) and full is not None and force < full:
            return replace(cad, grip_force_max_N=force)
        return cad
    return rejections[0]


def _with_body(
    spec: FingerSpec, finger: FingerDesign, gripper: Gripper, hand: HandModel, body_diameter_mm: float, body_length_mm: float
) -> GripperCad | Rejection:
    from gripwright.geometry import brep  # not needed to read a `GripperCad` from a record

    outside = _outside_hand(spec, finger.mesh, hand)
    if outside is not None:
        return outside
    measures = BodyMeasures(
        front_mm=float(finger.mesh.vertices_mm[:, 2].min()), diameter_mm=body_diameter_mm, length_mm=body_length_mm
    )
    shape = body_shape(gripper, hand, measures, spec.jaw)
    body = brep.tessellate(shape)
    if (reach := reach_mm(body)) > gripper.envelope_mm + _TOLERANCE_MM:
        return Rejection(
            "body-outside-envelope",
            f"the body of {gripper.actuator.name} reaches {reach:.2f} mm from the axis, "
            f"more than the palm envelope of {gripper.envelope_mm:.2f} mm",
        )
    return GripperCad(spec=spec, finger=finger, body_brep=brep.write_brep(shape), body=body, measures=measures)


def finger_spec(gripper: Gripper, contact_radii_mm: Sequence[float], grip_force_N: float, pad: Pad) -> FingerSpec:
    """What the gripper asks of its finger under this total grip force."""
    return FingerSpec(
        gripper_type=gripper.gripper_type,
        grip=gripper.grip,
        finger_length_mm=gripper.finger_length_mm,
        jaw_offset_mm=gripper.jaw_offset_mm,
        opening_min_mm=gripper.opening_min_mm,
        opening_max_mm=gripper.opening_max_mm,
        stroke_mm=gripper.actuator.stroke_mm,
        fingers=gripper.fingers,
        envelope_mm=gripper.envelope_mm,
        actuator=gripper.actuator,
        contact_radii_mm=tuple(contact_radii_mm),
        grip_force_N=grip_force_N,
        jaw=jaw_of(gripper.actuator),
        pad=pad,
        groove=gripper.groove,
        taper_rad=gripper.taper_rad,
        vee=gripper.vee,
    )


def _inclined_share(taper: Taper, finger: Mesh, room_mm: FloatArray) -> float:
    """Which share of the hand's tapered gripping surface the finger has."""
    triangles = transform(inverse(taper.X_FP), finger.triangles_mm)  # (m, 3, 3)
    low, high = np.array([0.0, -np.inf, -taper.slant_mm]), np.array([0.0, np.inf, 0.0])
    on_surface = ((triangles >= low - _TOLERANCE_MM) & (triangles <= high + _TOLERANCE_MM)).all(axis=(1, 2))
    return float(face_areas_mm2(finger)[on_surface].sum() / (taper.slant_mm * np.ptp(room_mm[:, 1])))


def _lesser_flank(tip: VTip, finger: Mesh) -> float:
    """Which share of a flank of the hand's V the finger has, of that of which it has less."""
    shares = []
    half, faces = tip.vee.width_mm / 2.0, face_areas_mm2(finger)
    for side in SIDES:
        y, z = finger.triangles_mm[..., 1] * side, finger.triangles_mm[..., 2]  # (m, 3)
        off = transform(inverse(tip.X_FP(side)), finger.triangles_mm)[..., 0]
        within = (y >= -_TOLERANCE_MM) & (y <= half + _TOLERANCE_MM) & (z >= -tip.height_mm - _TOLERANCE_MM)
        shares.append(float(faces[(within & (np.abs(off) <= _TOLERANCE_MM)).all(axis=1)].sum() / tip.flank_mm2))
    return min(shares)


def _misshapen(spec: FingerSpec, finger: Mesh, room_mm: FloatArray) -> Rejection | None:
    """Whether the gripping surface of the hand is not there."""
    if spec.vee is not None:
        share = _lesser_flank(VTip(vee=spec.vee, taper_rad=spec.taper_rad), finger)
        code, what = "finger-without-v", f"a flank of the V of {spec.vee.degrees:.1f}° is there"
    elif spec.taper_rad:
        share = _inclined_share(Taper(angle_rad=spec.taper_rad), finger, room_mm)
        code, what = "finger-not-tapered", f"the gripping surface is inclined by {np.degrees(spec.taper_rad):.1f}°"
    else:
        return None
    if share >= _WHOLE:
        return None
    return Rejection(code, f"{what} over {100.0 * share:.0f} % of the tip, at least {100.0 * _WHOLE:.0f} % is asked for")


def _outside_hand(spec: FingerSpec, finger: Mesh, hand: HandModel) -> Rejection | None:
    """Whether the finger leaves the room for which its grasps were found free of collision: the hand's stem, the palm."""
    vertices = finger.vertices_mm
    stem = vertices[vertices[:, 2] > -spec.finger_length_mm + _TOLERANCE_MM]
    room = np.concatenate([solid.vertices_mm for solid in hand.finger(spec.finger_length_mm, spec.grip)])
    excess = max(float((room.min(axis=0) - stem.min(axis=0)).max()), float((stem.max(axis=0) - room.max(axis=0)).max()))
    if excess > _TOLERANCE_MM:
        return Rejection("finger-outside-hand", f"the stem reaches {excess:.2f} mm out of the hand model's finger")
    if (misshapen := _misshapen(spec, finger, room)) is not None:
        return misshapen
    if spec.grip == SURFACE:  # a cup may be wider than the palm: what lies before it was judged by its own solids
        base = vertices[vertices[:, 2] < -spec.finger_length_mm + _TOLERANCE_MM]
        poses = hand.finger_poses(spec.opening_max_mm)
        reach = max((reach_mm(Mesh(vertices_mm=transform(X, base), faces=finger.faces)) for X in poses if len(base)), default=0.0)
    else:
        reach = reach_mm(finger, -spec.opening_max_mm / 2.0)
    if reach > spec.envelope_mm + _TOLERANCE_MM:
        return Rejection(
            "base-outside-envelope",
            f"the finger reaches {reach:.2f} mm from the axis, more than the palm envelope of {spec.envelope_mm:.2f} mm",
        )
    return None
