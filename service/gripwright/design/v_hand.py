"""The hand of a parallel gripper whose tips have a V, made from the flat hand of its type."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from gripwright.domain.grasp import EXTERNAL
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.domain.v_tip import SIDES, VTip
from gripwright.geometry.solids import box_vertices
from gripwright.plugin_api import HandModel, Params


class VHand:
    """A hand for an external grip: each finger is the two halves of its tip, beside each other, before a stem as wide.

    Behind the bottom of the V, and in its stem, it is as thick as the flat hand.
    """

    key: ClassVar[str] = "v_tips"
    params_model: ClassVar[type[Params]] = Params

    def __init__(self, flat: HandModel, tip: VTip) -> None:
        self.gripper_type, self.fingers = flat.gripper_type, flat.fingers
        self.tip = tip
        self._flat = flat
        corners = np.concatenate([solid.vertices_mm for solid in flat.finger(tip.height_mm, EXTERNAL)])
        self.thickness_mm = float(corners[:, 0].max()) + tip.depth_mm

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """As of the flat hand: the opening is measured at the planes x = 0, which the edges of the V reach."""
        return self._flat.finger_poses(opening_width_mm)

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """Both halves of the tip and the stem, frame F; the tip alone where the finger is no longer."""
        end = min(finger_length_mm, self.tip.height_mm)
        solids = self._halves(self.tip.section_mm(0.0), 0.0, self.tip.section_mm(-end), -end)
        if finger_length_mm > end:
            half = self.tip.vee.width_mm / 2.0
            low, high = np.array([self.tip.back_mm, -half, -finger_length_mm]), np.array([self.thickness_mm, half, -end])
            solids.append(ConvexSolid(vertices_mm=box_vertices(low, high), role="finger"))
        return tuple(solids)

    def way_out(self, way_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """What a finger passes through on its way back: the tip's innermost section leads, in front of the stem."""
        end = -self.tip.height_mm
        foremost = 0.0 if self.tip.slope > 0.0 else end
        section = self.tip.section_mm(foremost)
        solids = self._halves(section, foremost, section, -way_mm)
        return (*solids, *(() if foremost == 0.0 else self._halves(self.tip.section_mm(0.0), 0.0, section, end)))

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """As of the flat hand."""
        return self._flat.palm(finger_length_mm, envelope_mm, depth_mm)

    def opening_floor_mm(self, grip: str) -> float:
        """As of the flat hand: the edges meet."""
        return self._flat.opening_floor_mm(grip)

    def _halves(self, front: FloatArray, front_mm: float, rear: FloatArray, rear_mm: float) -> list[ConvexSolid]:
        """What lies between two sections of the V and the finger's back, on either side of its bottom."""
        solids = []
        for side in SIDES:
            corners = []
            for section, z in ((front, front_mm), (rear, rear_mm)):
                (x, y), bottom = section[0 if side < 0.0 else 2], section[1, 0]
                corners += [[x, y, z], [bottom, 0.0, z], [self.thickness_mm, 0.0, z], [self.thickness_mm, y, z]]
            solids.append(ConvexSolid(vertices_mm=np.array(corners), role="finger"))
        return solids
