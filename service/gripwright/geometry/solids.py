"""Convex solids as point sets: boxes, prisms, dilation and sweeps. All lengths in mm."""

from functools import lru_cache

import numpy as np
from scipy.spatial import ConvexHull

from gripwright.domain.shape import FloatArray, IntArray, Mesh

_CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


def box_vertices(low: FloatArray, high: FloatArray) -> FloatArray:
    """The 8 corners of an axis-aligned box, (8, 3)."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return np.asarray(low + _CORNERS * (high - low))


def prism_vertices(radius: float, z_low: float, z_high: float, sides: int = 16) -> FloatArray:
    """A regular prism about +z whose sides touch the cylinder of that radius from outside, (2·sides, 3)."""
    angle = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    ring = radius / np.cos(np.pi / sides) * np.stack([np.cos(angle), np.sin(angle)], axis=1)  # (sides, 2)
    return np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (z_low, z_high)])


def dilated(vertices: FloatArray, margin: float | FloatArray) -> FloatArray:
    """Points whose hull holds every point within `margin` of the hull of `vertices` (Minkowski sum with a cube).

    Three margins are those along x, y and z: the cube is a cuboid then.
    """
    if not np.any(margin):
        return vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if is_box(vertices):
        return box_vertices(low - margin, high + margin)
    offsets = (2.0 * _CORNERS - 1.0) * margin  # (8, 3)
    return hull_vertices((vertices[:, None] + offsets).reshape(-1, 3))


def is_box(vertices: FloatArray) -> bool:
    """Whether the points are the 8 corners of an axis-aligned box."""
    if len(vertices) != 8:
        return False
    high = vertices == vertices.max(axis=0)
    return bool((high | (vertices == vertices.min(axis=0))).all() and len(set((high @ [1, 2, 4]).tolist())) == 8)


def _is_prism(vertices: FloatArray, axis: int) -> bool:
    """Whether the points are two copies of one outline, at two levels along a coordinate axis."""
    level = vertices[:, axis]
    low, high = vertices[level == level.min()], vertices[level == level.max()]
    if len(low) + len(high) != len(vertices) or len(low) != len(high):
        return False
    return bool((np.delete(low, axis, axis=1) == np.delete(high, axis, axis=1)).all())


def hull_vertices(points: FloatArray) -> FloatArray:
    """Those of the points that are corners of their convex hull; the same points are asked about again and again."""
    return np.asarray(points[_hull_corners(points.tobytes())])


def hull_mesh(points: FloatArray) -> Mesh:
    """The convex hull of points as a mesh, for pictures: its faces look either way."""
    hull = ConvexHull(points)
    return Mesh(vertices_mm=np.asarray(points, dtype=float), faces=hull.simplices.astype(np.int64))


@lru_cache(maxsize=1024)
def _hull_corners(points: bytes) -> IntArray:
    return np.asarray(ConvexHull(np.frombuffer(points).reshape(-1, 3)).vertices, dtype=np.int64)


def swept(vertices: FloatArray, displacement: FloatArray) -> FloatArray:
    """Points whose hull is the sweep of a hull along a straight displacement (3,)."""
    moves = np.flatnonzero(np.abs(displacement) > 1e-9)
    if len(moves) == 0:
        return vertices
    if len(moves) == 1 and _is_prism(vertices, int(moves[0])):
        axis = int(moves[0])
        level = vertices[:, axis]
        leading = level == (level.max() if displacement[axis] > 0 else level.min())
        return np.asarray(vertices + leading[:, None] * displacement)
    return hull_vertices(np.concatenate([vertices, vertices + displacement]))
