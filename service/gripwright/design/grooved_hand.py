"""The hand of a three-finger gripper whose tips are concave; the hand of any gripper."""

from collections.abc import Sequence
from itertools import pairwise
from typing import ClassVar

import numpy as np

from gripwright.design.holder import sized_hand
from gripwright.design.tapered_hand import tapered
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL
from gripwright.domain.gripper import ConvexSolid, Gripper
from gripwright.domain.groove import Groove
from gripwright.domain.shape import FloatArray
from gripwright.plugin_api import HandModel, Params

_DEVIATION_MM = 0.002  # of the flats from the groove: the CAD lies within the solids, and they nearly within the CAD


class GroovedHand:
    """A hand with concave tips: its stems keep their place behind the component, and reach past it to either side.

    Each finger is a row of convex solids side by side, from the groove to the back.
    """

    key: ClassVar[str] = "grooved"
    params_model: ClassVar[type[Params]] = Params
    gripper_type: ClassVar[str] = CENTRIC_3
    fingers: ClassVar[int] = 3

    def __init__(self, flat: HandModel, groove: Groove) -> None:
        self._flat, self._groove = flat, groove

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """As of the flat hand: the opening is measured at the planes x = 0."""
        return self._flat.finger_poses(opening_width_mm)

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """The solids between the groove and the flat finger's back, frame F. For an external grip alone."""
        if grip != EXTERNAL:
            return self._flat.finger(finger_length_mm, grip)
        flat = np.concatenate([solid.vertices_mm for solid in self._flat.finger(finger_length_mm, grip)])
        back, front = float(flat[:, 0].max()) + self._groove.depth_mm, self._groove.chords_mm(_DEVIATION_MM)
        solids = []
        for low, high in pairwise(front):
            section = np.array([low, high, [back, high[1]], [back, low[1]]])  # (4, 2)
            ends = [np.column_stack([section, np.full(4, z)]) for z in (-finger_length_mm, 0.0)]
            solids.append(ConvexSolid(vertices_mm=np.concatenate(ends), role="finger"))
        return tuple(solids)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """As of the flat hand."""
        return self._flat.palm(finger_length_mm, envelope_mm, depth_mm)

    def opening_floor_mm(self, grip: str) -> float:
        """As of the flat hand: neighbouring fingers meet at the corners of their tips."""
        return self._flat.opening_floor_mm(grip)


def hand_of(gripper: Gripper, hand: HandModel) -> HandModel:
    """The hand of a gripper of that type: its tips as they are shaped, or its face of that size."""
    if gripper.groove is not None:
        return GroovedHand(hand, gripper.groove)
    return tapered(sized_hand(hand, gripper.opening_max_mm), gripper.taper_rad, gripper.vee)
