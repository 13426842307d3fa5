"""The gripping surface of a hand's fingers: a flat, or narrow flats that stand for a nose or a groove, an inclined flat, a V.

It is read off the hand's solids, but for the incline of tapered tips and the V. Lengths in mm.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.spatial import ConvexHull

from gripwright.design.tapered_hand import TaperedHand
from gripwright.design.v_hand import VHand
from gripwright.domain.grasp import EXTERNAL
from gripwright.domain.shape import BoolArray, FloatArray
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import SIDES, VTip
from gripwright.geometry.clipping import clip_to_box
from gripwright.geometry.frames import inverse, rotation_z, transform
from gripwright.geometry.held_surface import Surface
from gripwright.plugin_api import HandModel

_ROUND_RAD = float(np.radians(8.0))  # flats that turn by less from one to the next stand for a rounded surface
_ASIDE_RAD = float(np.radians(15.0))  # a nose touches with what faces the component, not with its sides


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flat:
    """A flat of the gripping surface: frame P is the finger's, turned and moved until the flat lies in P's x = 0.

    P's z leads along the flat to the tip's end, where it is 0.
    """

    X_FP: FloatArray  # (4, 4)
    width_mm: float
    rounding_rad: float  # by how much the true surface turns away from the flat; 0: it is flat


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GrippingSurface:
    """Finger frame F. `profile` runs across the finger: (y, how far the surface recedes there from the plane x = 0)."""

    profile: FloatArray  # (k, 2) ascending in y
    thickness_mm: float
    flats: tuple[Flat, ...]
    sign: float  # of x, where the component is not: +1 for an external grip, −1 for an internal one
    taper: Taper | None = None  # the profile lies in the plane x = 0 of its frame P then, and so do depths
    v: VTip | None = None  # the profile is that of the tip's end then, and recedes along z

    @property
    def y_range(self) -> tuple[float, float]:
        """Extent across the finger."""
        return float(self.profile[0, 0]), float(self.profile[-1, 0])

    @property
    def radius_mm(self) -> float:
        """Radius of the nose, of a groove negative; inf for a flat surface."""
        turn = 2.0 * sum(flat.rounding_rad for flat in self.flats)
        hollow = self.profile[:, 1].max() > self.profile[[0, -1], 1].max()
        return (-1.0 if hollow else 1.0) * sum(flat.width_mm for flat in self.flats) / turn if turn > 0.0 else np.inf

    @property
    def X_FP(self) -> FloatArray:
        """The frame of the profile."""
        return np.eye(4) if self.taper is None else self.taper.X_FP

    @property
    def slope(self) -> float:
        """Cosine of the angle between the gripping surface and the gripper's axis."""
        if self.v is not None:
            return float(np.cos(self.v.taper_rad))
        return 1.0 if self.taper is None else float(self.taper.X_FP[2, 2])

    @property
    def zones(self) -> tuple[tuple[Flat, ...], ...]:
        """Flats that touch together: all of them, or each flank of a V by itself."""
        return (self.flats,) if self.v is None else tuple((flat,) for flat in self.flats)

    def reach_mm(self, finger_length_mm: float) -> float:
        """How far back from the tip's end it reaches, along itself."""
        if self.v is not None:
            return min(finger_length_mm / self.slope, self.v.slant_mm)
        return finger_length_mm if self.taper is None else min(finger_length_mm / self.slope, self.taper.slant_mm)

    def rooms(self, finger_length_mm: float, around_mm: float) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        """Boxes that hold the finger and `around_mm` before and behind it: the pose of each seen from F, low and high corner.

        Of a V they leave out what lies before its flanks.
        """
        y_low, y_high = self.y_range
        inner, outer = sorted((0.0, self.sign * self.thickness_mm))
        low = np.array([inner - around_mm, y_low, -finger_length_mm])
        high = np.array([outer + around_mm, y_high, 0.0])
        if self.v is not None:
            low[0] += self.v.back_mm
            high[2] = -self.v.height_mm
            return [*((X_FP, *self._flank_room(X_FP, around_mm)) for X_FP in map(self.v.X_FP, SIDES)), (np.eye(4), low, high)]
        if self.taper is None:
            return [(np.eye(4), low, high)]
        tip_low, stem_low, stem_high = low.copy(), low.copy(), high.copy()
        tip_low[2], stem_low[0], stem_high[2] = -self.taper.slant_mm, low[0] + self.taper.stem_mm, -self.taper.height_mm
        return [(self.taper.X_FP, tip_low, high), (np.eye(4), stem_low, stem_high)]

    def depths_mm(self, triangles_P: FloatArray) -> FloatArray:
        """How deep in the finger, along x, each corner of triangles (m, 3, 3) in the profile's frame lies, negative before it.

        Where an edge passes from one flat to the next is a corner too: in between, the depth is linear.
        """
        a, b = triangles_P.reshape(-1, 3), np.roll(triangles_P, -1, axis=1).reshape(-1, 3)
        levels = self.profile[1:-1, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (levels - a[:, 1:2]) / (b[:, 1:2] - a[:, 1:2])  # (3m, k)
        edge, level = np.nonzero((share > 0.0) & (share < 1.0))
        points = np.concatenate([a, a[edge] + share[edge, level, None] * (b[edge] - a[edge])])
        depths = np.asarray(self.sign * points[:, 0] - np.interp(points[:, 1], self.profile[:, 0], self.profile[:, 1]))
        return depths if self.v is None else np.asarray(depths + self.v.slope * points[:, 2])

    def flank_patch(
        self, flat: Flat, surface: Surface, X_CF: FloatArray, length_mm: float, chosen: BoolArray, gap_mm: float
    ) -> FloatArray:
        """The chosen triangles of a surface up to `gap_mm` off one flank of a V, seen from the flat's frame, (k, 3, 3)."""
        assert self.v is not None
        side, far = np.sign(flat.X_FP[1, 3]), self.thickness_mm + gap_mm
        y_low, y_high = sorted((0.0, side * self.v.vee.width_mm / 2.0))
        low, high = np.array([-far, y_low, -min(length_mm, self.v.height_mm)]), np.array([far, y_high, 0.0])
        before = transform(inverse(flat.X_FP), surface.within(X_CF, low, high, chosen))
        return clip_to_box(before, np.array([-gap_mm, -np.inf, -np.inf]), np.array([gap_mm, np.inf, np.inf]))

    def _flank_room(self, X_FP: FloatArray, around_mm: float) -> tuple[FloatArray, FloatArray]:
        """Low and high corner of a box about a flank of a V, in the flank's frame."""
        assert self.v is not None
        side = np.sign(X_FP[1, 3])
        sections = [(self.v.section_mm(z), z) for z in (0.0, -self.v.height_mm)]
        corners = np.array([[*section[k], z] for section, z in sections for k in (1, 1 + int(side))])  # (4, 3)
        in_plane = transform(inverse(X_FP), corners)
        around = np.array([around_mm, 0.0, 0.0])
        return in_plane.min(axis=0) - around, in_plane.max(axis=0) + around


def gripping_surface(hand: HandModel, grip: str) -> GrippingSurface:
    """The side of the hand's finger that faces the component."""
    if isinstance(hand, TaperedHand) and grip == EXTERNAL:
        flat, taper = gripping_surface(hand.flat, grip), hand.taper
        flats = tuple(replace(one, X_FP=taper.X_FP @ one.X_FP) for one in flat.flats)
        return replace(flat, flats=flats, thickness_mm=flat.thickness_mm + taper.depth_mm, taper=taper)
    if isinstance(hand, VHand) and grip == EXTERNAL:
        return _of_v(hand.tip, hand.thickness_mm)
    sections = tuple(solid.vertices_mm[:, :2].tobytes() for solid in hand.finger(10.0, grip))
    return _of_sections(sections, 1.0 if grip == EXTERNAL else -1.0)


def _of_v(tip: VTip, thickness_mm: float) -> GrippingSurface:
    width = tip.vee.width_mm / 2.0 / np.cos(tip.vee.turn_rad)
    flats = tuple(Flat(X_FP=tip.X_FP(side), width_mm=float(width), rounding_rad=0.0) for side in SIDES)
    profile = tip.section_mm(0.0)[:, ::-1]
    return GrippingSurface(profile=profile, thickness_mm=thickness_mm, flats=flats, sign=1.0, v=tip)


@lru_cache(maxsize=64)
def _of_sections(sections_xy: tuple[bytes, ...], sign: float) -> GrippingSurface:
    outlines = [np.frombuffer(points_xy).reshape(-1, 2) * [sign, 1.0] for points_xy in sections_xy]
    chains = [_facing(outline) for outline in outlines]
    y = np.unique(np.concatenate([chain[:, 0] for chain in chains]))
    x = np.min([np.interp(y, chain[:, 0], chain[:, 1], left=np.inf, right=np.inf) for chain in chains], axis=0)
    profile = np.stack([y, x], axis=1)
    return GrippingSurface(
        profile=profile,
        thickness_mm=float(max(outline[:, 0].max() for outline in outlines)),
        flats=_flats(profile, sign),
        sign=sign,
    )


def _facing(outline: FloatArray) -> FloatArray:
    """The side at small x of a convex solid's section (n, 2): (y, x) of its corners, ascending in y."""
    hull = outline[ConvexHull(outline).vertices]  # (n, 2) counter-clockwise
    edges = np.roll(hull, -1, axis=0) - hull
    facing = edges[:, 1] < -1e-9 * np.linalg.norm(edges, axis=1)
    first = int(np.flatnonzero(facing & ~np.roll(facing, 1))[0])
    return np.asarray(np.roll(hull, -first, axis=0)[: int(facing.sum()) + 1][::-1, ::-1])


def _flats(profile: FloatArray, sign: float) -> tuple[Flat, ...]:
    """The flats that face the component, each with half the turn to its nearer neighbour where that is small."""
    steps = np.diff(profile, axis=0)  # (k - 1, 2)
    aside = np.arctan2(steps[:, 1], steps[:, 0])  # 0: faces along x
    turns = np.abs(np.diff(aside))
    flats = []
    for k in np.flatnonzero(np.abs(aside) <= _ASIDE_RAD):
        around = [turn for turn in turns[max(k - 1, 0) : k + 1] if turn < _ROUND_RAD]
        X_FP = rotation_z(-sign * float(aside[k]))
        middle = profile[k : k + 2].mean(axis=0)
        X_FP[:2, 3] = sign * middle[1], middle[0]
        flats.append(Flat(X_FP=X_FP, width_mm=float(np.linalg.norm(steps[k])), rounding_rad=max(around, default=0.0) / 2.0))
    return tuple(flats)
