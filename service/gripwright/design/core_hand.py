"""What the fingers of many neighbouring grasps have in common: where that hits something, every one of the grasps does."""

from collections.abc import Sequence
from typing import cast

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from gripwright.design.tapered_hand import shortest_finger_mm
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.plugin_api import HandModel

_SHARE = 0.6  # of a finger's width that may be lost to turning; so far behind the tips reaches the core
_LEAST_MM = 2.0  # a shorter core says nothing
_THIN_MM = 0.02
_ROUNDING_MM = 1e-6


def core_hand(hand: HandModel, grip: str, opening_mm: float, half: FloatArray) -> HandModel | None:
    """A hand whose fingers lie within those of every grasp up to `half` (turned about x and z, shifted along y and z) away.

    It may be asked about collisions of fingers only. None: they have too little in common, or have tapered or V tips.
    """
    if shortest_finger_mm(hand) > 0.0:
        return None
    core = _CoreHand(hand, grip, opening_mm, half)
    across = hand.finger_poses(opening_mm)[:, 0, 1]  # of the gripper's y in each finger's own directions
    alike = bool(np.abs(across).max() < 1e-9 or half[[0, 2]].max() == 0.0)
    return cast(HandModel, core) if alike and core.reach_mm >= _LEAST_MM else None  # its type and fingers are no class variables


class _CoreHand:
    """Convex solids of fingers, straight or shaped, drawn in by as much as any of their points moves."""

    def __init__(self, hand: HandModel, grip: str, opening_mm: float, half: FloatArray) -> None:
        self.gripper_type, self.fingers = hand.gripper_type, hand.fingers
        self._hand, self._half = hand, half
        tip = np.concatenate([solid.vertices_mm for solid in hand.finger(10.0, grip)])
        self._wide = float(np.abs(tip[:, 1]).max())
        self._off_axis = opening_mm / 2.0 + float(np.abs(tip[:, 0]).max())
        self.reach_mm = self._reach(min(float(np.ptp(solid.vertices_mm[:, 1])) for solid in hand.finger(10.0, grip)))
        self._made: dict[tuple[float, str], list[ConvexSolid]] = {}

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """As of the hand."""
        return self._hand.finger_poses(opening_width_mm)

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """What is left of each solid, frame F."""
        key = (finger_length_mm, grip)
        if key not in self._made:
            solids = self._hand.finger(finger_length_mm, grip)
            drawn = [(solid, _drawn_in(solid.vertices_mm, self._moves_mm(), self.reach_mm)) for solid in solids]
            self._made[key] = [ConvexSolid(vertices_mm=left, role=solid.role) for solid, left in drawn if left is not None]
        return self._made[key]

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """None."""
        return ()

    def opening_floor_mm(self, grip: str) -> float:
        """As of the hand."""
        return self._hand.opening_floor_mm(grip)

    def _reach(self, width_mm: float) -> float:
        """How far behind the tips fingers that are turned have a good part of their width in common."""
        about_x, about_z, aside, along = self._half
        left = _SHARE * width_mm / 2.0 - aside - self._off_axis * np.sin(about_z)
        if about_x > 0.0:
            return float(left / np.sin(about_x) - along)
        return float("inf") if left > 0.0 else 0.0

    def _moves_mm(self) -> FloatArray:
        """How far a point of a finger moves at the most along the finger's x, y and z, (3,): within the reach."""
        about_x, about_z, aside, along = self._half
        reach = self.reach_mm + along if about_x > 0.0 else 0.0
        wide = self._wide + aside
        y = aside + wide * (1.0 - np.cos(about_x)) + reach * np.sin(about_x)
        z = along + reach * (1.0 - np.cos(about_x)) + wide * np.sin(about_x)
        turned = 1.0 - np.cos(about_z)
        x = self._off_axis * turned + (wide + y) * np.sin(about_z)
        return np.array([x, y + self._off_axis * np.sin(about_z) + (wide + y) * turned, z])


def _drawn_in(vertices: FloatArray, moves_mm: FloatArray, reach_mm: float) -> FloatArray | None:
    """Corners of what lies within every copy of a convex solid moved by up to `moves_mm`, and at z ≥ −reach; None: nothing."""
    planes = ConvexHull(vertices).equations  # n·p + d ≤ 0
    planes = np.column_stack([planes[:, :3], planes[:, 3] + np.abs(planes[:, :3]) @ moves_mm + _ROUNDING_MM])
    if np.isfinite(reach_mm):
        planes = np.concatenate([planes, [[0.0, 0.0, -1.0, -reach_mm]]])
    best = linprog(
        [0.0, 0.0, 0.0, -1.0],
        A_ub=np.column_stack([planes[:, :3], np.ones(len(planes))]),
        b_ub=-planes[:, 3],
        bounds=(None, None),
    )
    if best.x is None or best.x[3] < _THIN_MM:
        return None
    corners = HalfspaceIntersection(planes, best.x[:3]).intersections
    return np.unique(np.round(corners, 6), axis=0)
