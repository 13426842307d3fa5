"""How the grasps of one gripper type are seated, touch and hold: as jaws do, or as a holding plug-in says."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gripwright.design import contact, holding
from gripwright.design.tapered_hand import shortest_finger_mm
from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import Grasp, Hold
from gripwright.domain.gripper import Actuator
from gripwright.domain.holding import Contact, Load
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api import FaceHand, HandModel, HoldingModel, RunContext

Models = Mapping[str, HoldingModel]
"""Gripper type → what holds; types that are not among them close jaws."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Holder:
    """What holds grasps of one gripper type."""

    model: HoldingModel | None  # None: jaws
    ctx: RunContext

    def seat(self, grasp: Grasp, surface: Surface, hand: HandModel) -> Grasp | Rejection:
        """The grasp as it just touches the component."""
        if self.model is None:
            return contact.seat(grasp, surface, hand)
        return self.model.seat(grasp, surface, hand, self.ctx)

    def contacts(
        self, grasp: Grasp, surface: Surface, hand: HandModel, finger_length_mm: float
    ) -> tuple[Contact, ...] | Rejection:
        """The contacts of a seated grasp, or why it does not touch as it must."""
        if self.model is None:
            return contact.contacts(grasp, surface, hand, finger_length_mm, self.ctx.min_contact_mm)
        found = self.model.contacts(grasp, surface, hand, finger_length_mm, self.ctx)
        return found if isinstance(found, Rejection) else tuple(found)

    def hold(
        self, grasp: Grasp, touching: tuple[Contact, ...], radius_mm: float, load: Load, component: Component
    ) -> Hold | Rejection:
        """What holding asks of the gripper, or why no force holds. `radius_mm` as `holding.contact_radius_mm`, of jaws."""
        if self.model is not None:
            return self.model.hold(grasp, touching, load, component, self.ctx)
        held = holding.hold(grasp, touching, radius_mm, load, component.friction, self.ctx.pad)
        if not np.isfinite(held.required_force_N):
            return Rejection(
                "not-held", f"no grip force holds it: at friction {component.friction:g} the squeezed surfaces slip out"
            )
        return held


def grip_force_N(actuator: Actuator, opening_width_mm: float, models: Models) -> float | None:
    """What an actuator grips with at that opening; None: not known."""
    model = models.get(actuator.gripper_type)
    return actuator.grip_force_N if model is None else model.grip_force_N(actuator, opening_width_mm)


def sized_hand(hand: HandModel, opening_width_mm: float) -> HandModel:
    """The hand as it is for that opening: one that holds by a face is as large as this."""
    return hand.sized(opening_width_mm) if isinstance(hand, FaceHand) else hand


def least_length_mm(hand: HandModel, ctx: RunContext) -> float:
    """The finger length from which on there is a hand: the least contact or a tapered tip, of a face what carries it."""
    return hand.finger_length_min_mm() if isinstance(hand, FaceHand) else max(ctx.min_contact_mm, shortest_finger_mm(hand))
