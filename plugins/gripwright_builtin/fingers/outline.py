"""The base of a finger in plan: a convex outline from the jaw's bolts to the stem, mitred against the other fingers' bases.

Finger frame: the gripper's axis stands at x = −W/2, y = 0.
"""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HalfPlane:
    """The points with normal · p ≥ distance; `normal` is a unit vector."""

    normal: FloatArray  # (2,)
    distance_mm: float

    def depth_mm(self, points_mm: FloatArray) -> FloatArray:
        """How far inside each point (…, 2) lies; negative outside."""
        return np.asarray(points_mm @ self.normal - self.distance_mm)


def sector(fingers: int, opening_mm: float, gap_mm: float) -> tuple[HalfPlane, HalfPlane]:
    """The room of one finger among several at this opening: both bisecting planes, each pulled in by `gap_mm`."""
    half = np.pi / fingers
    sides = (np.array([np.sin(half), sign * np.cos(half)]) for sign in (1.0, -1.0))
    left, right = (HalfPlane(normal=n, distance_mm=float(gap_mm - n[0] * opening_mm / 2.0)) for n in sides)
    return left, right


def rectangle(x_min_mm: float, x_max_mm: float, width_mm: float) -> FloatArray:
    """Corners of a rectangle that is symmetric about the x axis, (4, 2), counter-clockwise."""
    y = width_mm / 2.0
    return np.array([[x_min_mm, -y], [x_max_mm, -y], [x_max_mm, y], [x_min_mm, y]])


def convex_hull(points_mm: FloatArray) -> FloatArray:
    """Convex hull of some points (n, 2), counter-clockwise, without points on its edges (Andrew's monotone chain)."""
    points = np.unique(np.round(points_mm, 9), axis=0)  # sorted by x, then y
    return np.array(_chain(points)[:-1] + _chain(points[::-1])[:-1])


def _chain(points: FloatArray) -> list[FloatArray]:
    chain: list[FloatArray] = []
    for point in points:
        while len(chain) >= 2 and _turn(chain[-2], chain[-1], point) <= 1e-9:
            chain.pop()
        chain.append(point)
    return chain


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def clip(polygon_mm: FloatArray, half_plane: HalfPlane) -> FloatArray:
    """The part of a convex polygon inside a half-plane; empty where nothing is."""
    kept: list[FloatArray] = []
    depths = half_plane.depth_mm(polygon_mm)
    for i, (point, depth) in enumerate(zip(polygon_mm, depths, strict=True)):
        before, depth_before = polygon_mm[i - 1], depths[i - 1]
        if (depth >= 0.0) != (depth_before >= 0.0):
            kept.append(before + (point - before) * depth_before / (depth_before - depth))
        if depth >= 0.0:
            kept.append(point)
    return convex_hull(np.array(kept)) if kept else np.empty((0, 2))


def inset_mm(polygon_mm: FloatArray, points_mm: FloatArray) -> float:
    """Smallest distance of the points from the edges of a convex counter-clockwise polygon; negative outside."""
    edges = np.roll(polygon_mm, -1, axis=0) - polygon_mm  # (k, 2)
    inward = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1, keepdims=True)
    depths = np.einsum("kj,pkj->pk", inward, points_mm[:, None, :] - polygon_mm[None, :, :])
    return float(depths.min())


def width_mm(polygon_mm: FloatArray, x_mm: FloatArray) -> FloatArray:
    """Width across y of an outline symmetric about the x axis, at each x inside it."""
    upper = polygon_mm[polygon_mm[:, 1] >= 0.0]
    upper = upper[np.lexsort((upper[:, 1], upper[:, 0]))]
    return np.asarray(2.0 * np.interp(x_mm, upper[:, 0], upper[:, 1]))
