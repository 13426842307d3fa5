"""The hand of a gripper whose tips are tapered, made from the flat hand of its type; what is asked of any hand's tips."""

from collections.abc import Sequence
from typing import ClassVar, cast

import numpy as np

from gripwright.design.v_hand import VHand
from gripwright.domain.grasp import EXTERNAL
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import Vee, VTip
from gripwright.geometry.solids import box_vertices
from gripwright.plugin_api import HandModel, Params


class TaperedHand:
    """A hand for an external grip: each finger is a wedge, the tip, before a straight stem as thick as the flat hand's."""

    key: ClassVar[str] = "tapered"
    params_model: ClassVar[type[Params]] = Params

    def __init__(self, flat: HandModel, taper: Taper) -> None:
        self.gripper_type, self.fingers = flat.gripper_type, flat.fingers
        self.flat, self.taper = flat, taper

    def finger_poses(self, opening_width_mm: float) -> FloatArray:
        """As of the flat hand: the opening is measured at the planes x = 0, which the tapered surfaces reach with one edge."""
        return self.flat.finger_poses(opening_width_mm)

    def finger(self, finger_length_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """Tip and stem, frame F; the tip alone where the finger is no longer."""
        taper, end = self.taper, min(finger_length_mm, self.taper.height_mm)
        low, high = self._sides()
        at_end = taper.tip_mm + (taper.stem_mm - taper.tip_mm) * end / taper.height_mm
        section = [(taper.tip_mm, 0.0), (high[0], 0.0), (high[0], -end), (at_end, -end)]  # (x, z)
        tip = np.array([[x, y, z] for y in (low[1], high[1]) for x, z in section])
        solids = [ConvexSolid(vertices_mm=tip, role="finger")]
        if finger_length_mm > end:
            stem = box_vertices(np.array([taper.stem_mm, low[1], -finger_length_mm]), np.array([high[0], high[1], -end]))
            solids.append(ConvexSolid(vertices_mm=stem, role="finger"))
        return tuple(solids)

    def way_out(self, way_mm: float, grip: str) -> Sequence[ConvexSolid]:
        """What a finger passes through on its way back: where the tip reaches in front of the stem, so does its way."""
        if self.taper.stem_mm <= self.taper.tip_mm:
            return self.finger(way_mm, grip)
        low, high = self._sides()
        corners = box_vertices(np.array([0.0, low[1], -way_mm]), np.array([*high, 0.0]))
        return (ConvexSolid(vertices_mm=corners, role="finger"),)

    def palm(self, finger_length_mm: float, envelope_mm: float, depth_mm: float) -> Sequence[ConvexSolid]:
        """As of the flat hand."""
        return self.flat.palm(finger_length_mm, envelope_mm, depth_mm)

    def opening_floor_mm(self, grip: str) -> float:
        """As of the flat hand: the innermost edges meet."""
        return self.flat.opening_floor_mm(grip)

    def _sides(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest x and y of a finger, (2,) each."""
        corners = np.concatenate([solid.vertices_mm for solid in self.flat.finger(self.taper.height_mm, EXTERNAL)])
        low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
        return low, high + np.array([self.taper.depth_mm, 0.0])


def tapered(hand: HandModel, taper_rad: float, vee: Vee | None = None) -> HandModel:
    """The hand with tips of that taper and that V; itself where there is neither."""
    if vee is not None:
        return cast(HandModel, VHand(hand, VTip(vee=vee, taper_rad=taper_rad)))  # its type and fingers are no class variables
    if taper_rad == 0.0:
        return hand
    return cast(HandModel, TaperedHand(hand, Taper(angle_rad=taper_rad)))


def taper_rad_of(hand: HandModel) -> float:
    """The taper of a hand's tips; 0: they are straight."""
    match hand:
        case TaperedHand():
            return hand.taper.angle_rad
        case VHand():
            return hand.tip.taper_rad
        case _:
            return 0.0


def vee_of(hand: HandModel) -> Vee | None:
    """The V of a hand's tips; None: they are flat."""
    return hand.tip.vee if isinstance(hand, VHand) else None


def leaving_mm(hand: HandModel) -> float:
    """How much farther than the plan's release clearance a hand opens to let go."""
    tip = _tip(hand)
    return 0.0 if tip is None else tip.leaving_mm


def shortest_finger_mm(hand: HandModel) -> float:
    """Fingers are at least as long as their tips."""
    tip = _tip(hand)
    return 0.0 if tip is None else tip.height_mm


def thicker_mm(hand: HandModel) -> float:
    """By how much more than a flat finger one with a V reaches outwards from the plane x = 0."""
    return hand.tip.depth_mm if isinstance(hand, VHand) else 0.0


def way_out(hand: HandModel, way_mm: float, grip: str) -> Sequence[ConvexSolid]:
    """What a finger passes through on its way back; of a straight one that is a longer finger."""
    return hand.way_out(way_mm, grip) if isinstance(hand, TaperedHand | VHand) else hand.finger(way_mm, grip)


def _tip(hand: HandModel) -> Taper | VTip | None:
    match hand:
        case TaperedHand():
            return hand.taper
        case VHand():
            return hand.tip
        case _:
            return None
