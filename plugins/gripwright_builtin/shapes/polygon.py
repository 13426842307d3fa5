"""Solids over a polygon, straight or led to a point: what lies on them, and how they look. Lengths in mm."""

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, Mesh
from gripwright.geometry.drawn import extruded
from gripwright.geometry.frames import pose


def regular_outline(sides: int, inradius: float) -> FloatArray:
    """Corners of the polygon whose first side faces along x, counter-clockwise, (sides, 2)."""
    angle = 2.0 * np.pi * (np.arange(sides) - 0.5) / sides
    return np.asarray(inradius / np.cos(np.pi / sides) * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def regular_solid(
    sides: int, center_C: FloatArray, axis_C: FloatArray, side_C: FloatArray, inradius_mm: float, height_mm: float, top: float
) -> Mesh:
    """The solid over that polygon, whose far end is `top` times as large."""
    foot = center_C - axis_C * height_mm / 2.0
    return extruded(regular_outline(sides, inradius_mm), pose(side_C, np.cross(axis_C, side_C), axis_C, foot), height_mm, top)


def on_planes(
    points_mm: FloatArray,
    facing: FloatArray,
    planes: tuple[FloatArray, FloatArray],
    tolerance_mm: float,
    angle_rad: float,
) -> BoolArray:
    """Which points (n, 3) with normals (n, 3) lie on the convex solid of planes: unit normals (k, 3) and offsets (k,), (n,)."""
    normals, offsets = planes
    beyond = points_mm @ normals.T - offsets  # (n, k)
    inside = (beyond <= tolerance_mm).all(axis=1)
    on = (np.abs(beyond) <= tolerance_mm) & (facing @ normals.T >= np.cos(angle_rad))
    return np.asarray(inside & on.any(axis=1))


def side_planes(
    sides: int, center_C: FloatArray, axis_C: FloatArray, side_C: FloatArray, inradius_mm: float, half_angle_rad: float
) -> tuple[FloatArray, FloatArray]:
    """Outward unit normals (sides, 3) and offsets (sides,) of sides at that distance from the axis at its midpoint."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    towards = np.cos(turn)[:, None] * side_C + np.sin(turn)[:, None] * np.cross(axis_C, side_C)
    normals = np.cos(half_angle_rad) * towards + np.sin(half_angle_rad) * axis_C
    return normals, normals @ center_C + np.cos(half_angle_rad) * inradius_mm


def on_sides_and_ends(
    points_mm: FloatArray,
    normals: FloatArray,
    around: tuple[FloatArray, FloatArray],
    solid: tuple[FloatArray, FloatArray, float, bool],
    tolerance_mm: float,
    angle_rad: float,
) -> BoolArray:
    """Which points (n, 3) lie on the side planes of a solid (centre, axis, height, whether it is hollow) or on its ends.

    A hollow has no end faces, and its sides face inwards.
    """
    center_C, axis_C, height_mm, internal = solid
    if internal:
        within = np.abs((points_mm - center_C) @ axis_C) <= height_mm / 2.0 + tolerance_mm
        return np.asarray(within & on_planes(points_mm, -normals, around, tolerance_mm, angle_rad))
    ends = np.stack([-axis_C, axis_C])
    planes = (np.concatenate([around[0], ends]), np.concatenate([around[1], ends @ center_C + height_mm / 2.0]))
    return on_planes(points_mm, normals, planes, tolerance_mm, angle_rad)
