"""The gripping surface of a hand's fingers, read off its solids: a flat, or narrow flats that stand for a nose or a groove.

Lengths in mm.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial import ConvexHull

from gripwright.domain.grasp import EXTERNAL
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import rotation_z
from gripwright.plugin_api import HandModel

_ROUND_RAD = float(np.radians(8.0))  # flats that turn by less from one to the next stand for a rounded surface
_ASIDE_RAD = float(np.radians(15.0))  # a nose touches with what faces the component, not with its sides


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flat:
    """A flat of the gripping surface: frame P is the finger's, turned about z and moved until the flat lies in P's x = 0."""

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

    def depths_mm(self, triangles_F: FloatArray) -> FloatArray:
        """How deep in the finger, along x, each corner of triangles (m, 3, 3) lies, negative before it, (k,).

        Where an edge passes from one flat to the next is a corner too: in between, the depth is linear.
        """
        a, b = triangles_F.reshape(-1, 3), np.roll(triangles_F, -1, axis=1).reshape(-1, 3)
        levels = self.profile[1:-1, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (levels - a[:, 1:2]) / (b[:, 1:2] - a[:, 1:2])  # (3m, k)
        edge, level = np.nonzero((share > 0.0) & (share < 1.0))
        points = np.concatenate([a, a[edge] + share[edge, level, None] * (b[edge] - a[edge])])
        return np.asarray(self.sign * points[:, 0] - np.interp(points[:, 1], self.profile[:, 0], self.profile[:, 1]))


def gripping_surface(hand: HandModel, grip: str) -> GrippingSurface:
    """The side of the hand's finger that faces the component."""
    sections = tuple(solid.vertices_mm[:, :2].tobytes() for solid in hand.finger(10.0, grip))
    return _of_sections(sections, 1.0 if grip == EXTERNAL else -1.0)


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
