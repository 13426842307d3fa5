"""Stage "tips": fingertips that are shaped to what a gripper of the set holds, where every promise is kept with them too."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gripwright.design.contact import contacts, seat
from gripwright.design.grasp_judge import HeldComponent
from gripwright.design.gripping_surface import gripping_surface
from gripwright.design.grooved_hand import GroovedHand
from gripwright.design.hand_check import OperationScene
from gripwright.design.handles import safety_factor
from gripwright.design.holding import contact_radius_mm, hold
from gripwright.design.holding_load import operation_load
from gripwright.design.stages.fingers import GripperCad, design_gripper_cad
from gripwright.design.stages.verify import verify_handle
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL
from gripwright.domain.gripper import Gripper, Handle
from gripwright.domain.groove import Groove
from gripwright.domain.shape import Cylinder, Primitive
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api import FingerDesigner, HandModel, RunContext, TipShaper

_AS_MUCH = 1.02  # a bent patch is reckoned as flat at its centre, which lies a little nearer to the axis than a flat finger's


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandleScene:
    """What the grasp of one handle is judged by."""

    held: HeldComponent
    scene: OperationScene
    primitive: Primitive  # of the segment that is held


def with_shaped_tips(
    gripper: Gripper,
    scenes: Sequence[HandleScene],
    designer: FingerDesigner,
    hand: HandModel,
    body_size_mm: tuple[float, float],
    force_margin: float,
    ctx: RunContext,
) -> Gripper:
    """The gripper with concave tips of which all handles hold and whose CAD keeps every promise; as it is where there is none.

    The jaws stand where they stood: the planes x = 0 move towards the component by the groove's depth, but for what a faceted
    component bears against its flanks, and with them the opening range and the jaw offset.
    """
    groove = _groove(gripper, scenes, designer, hand)
    if groove is None:
        return gripper
    grooved = GroovedHand(hand, groove)
    handles = [_shaped(gripper, handle, at, grooved, groove, ctx) for handle, at in zip(gripper.handles, scenes, strict=True)]
    held = tuple(handle for handle in handles if handle is not None)
    if len(held) < len(scenes):
        return gripper
    shift = max(new.opening_width_mm - old.opening_width_mm for new, old in zip(held, gripper.handles, strict=True))
    shaped = replace(
        gripper,
        opening_min_mm=max(gripper.opening_min_mm + shift, hand.opening_floor_mm(EXTERNAL)),
        opening_max_mm=gripper.opening_max_mm + shift,
        jaw_offset_mm=gripper.jaw_offset_mm + shift / 2.0,
        groove=groove,
        handles=held,
    )
    if any(handle.opening_width_mm < shaped.opening_min_mm for handle in held):
        return gripper
    needed = max(handle.hold.required_force_N for handle in held)
    cad = design_gripper_cad(shaped, designer, grooved, [], *body_size_mm, needed, force_margin, ctx)
    kept = isinstance(cad, GripperCad) and all(
        not verify_handle(shaped, handle, cad.finger.mesh, cad.body, grooved, at.scene, at.held.solid, ctx).faults
        for handle, at in zip(held, scenes, strict=True)
    )
    return shaped if kept else gripper


def _groove(gripper: Gripper, scenes: Sequence[HandleScene], designer: FingerDesigner, hand: HandModel) -> Groove | None:
    """What the designer would cut, where a three-finger gripper holds nothing but cylinders from outside."""
    if not isinstance(designer, TipShaper) or gripper.gripper_type != CENTRIC_3 or gripper.grip != EXTERNAL or gripper.taper_rad:
        return None
    radii = []
    for handle, at in zip(gripper.handles, scenes, strict=True):
        if not isinstance(at.primitive, Cylinder) or at.primitive.internal:
            return None
        radii.append(max(at.primitive.radius_mm, handle.opening_width_mm / 2.0))
    low, high = gripping_surface(hand, EXTERNAL).y_range
    return designer.groove(radii, high - low)


def _shaped(
    gripper: Gripper, handle: Handle, at: HandleScene, hand: GroovedHand, groove: Groove, ctx: RunContext
) -> Handle | None:
    """The handle with its grasp seated in the groove; None where it does not touch there, or needs clearly more force."""
    surface, held = Surface(at.held.solid), at.held
    planned = replace(
        handle.grasp,
        opening_width_mm=handle.opening_width_mm - 2.0 * groove.depth_mm,
        contact_offset_mm=groove.depth_mm,
    )
    seated = seat(planned, surface, hand)
    if isinstance(seated, Rejection):
        return None
    touching = contacts(seated, surface, hand, gripper.finger_length_mm, ctx.min_contact_mm)
    if isinstance(touching, Rejection):
        return None
    load = operation_load(at.scene.motion, at.scene.X_PC, held.centroid_C, held.mass_kg, held.force_N)
    radius = contact_radius_mm(at.primitive, gripping_surface(hand, EXTERNAL), ctx.pad)
    found = hold(seated, touching, radius, load, held.component.friction, ctx.pad)
    if found.required_force_N > handle.hold.required_force_N * _AS_MUCH:
        return None
    return replace(
        handle,
        opening_width_mm=seated.opening_width_mm,
        release_opening_mm=handle.release_opening_mm - handle.opening_width_mm + seated.opening_width_mm,
        grasp=seated,
        hold=found,
        safety_factor=safety_factor(gripper.actuator.grip_force_N, found),
    )
