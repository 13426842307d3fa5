"""Closed meshes of primitives, for pictures. Lengths in mm."""

import manifold3d
import numpy as np

from gripwright.domain.shape import Box, Cylinder, DrawnPrimitive, FloatArray, Mesh, Primitive
from gripwright.geometry.frames import pose_along, transform

_SECTIONS = 96  # of a full turn


def primitive_mesh(primitive: Primitive) -> Mesh | None:
    """The closed surface of a primitive, in its component's frame; None where it does not say what it looks like."""
    if isinstance(primitive, Cylinder):
        r, half = primitive.radius_mm, primitive.height_mm / 2.0
        profile = np.array([[0.0, -half], [r, -half], [r, half], [0.0, half]])
        return revolved(profile, pose_along(primitive.axis_C, primitive.center_C))
    if isinstance(primitive, Box):
        half_x, half_y, half_z = primitive.extents_mm / 2.0
        outline = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
        X = primitive.X_CB.copy()
        X[:3, 3] -= X[:3, 2] * half_z
        return extruded(outline, X, 2.0 * float(half_z))
    return primitive.drawn() if isinstance(primitive, DrawnPrimitive) else None


def revolved(profile: FloatArray, X: FloatArray, arc_rad: float = 2.0 * np.pi) -> Mesh:
    """A counter-clockwise profile (k, 2) of (radius, z) turned about z of the pose X, from its x on, closed."""
    size = float(np.abs(profile).max())
    outline = manifold3d.CrossSection([profile / size])
    return _placed(manifold3d.Manifold.revolve(outline, _SECTIONS, float(np.degrees(arc_rad))), size, X)


def extruded(outline: FloatArray, X: FloatArray, height_mm: float, top: float = 1.0) -> Mesh:
    """A counter-clockwise outline (k, 2) in the plane z = 0 of the pose X, led along its z, closed.

    `top`: its size at the far end, as a share.
    """
    size = float(np.abs(outline).max())
    section = manifold3d.CrossSection([outline / size])
    return _placed(manifold3d.Manifold.extrude(section, height_mm / size, scale_top=(top, top)), size, X)


def _placed(solid: manifold3d.Manifold, size_mm: float, X: FloatArray) -> Mesh:
    found = solid.to_mesh64()
    points = np.array(found.vert_properties[:, :3], dtype=float) * size_mm
    return Mesh(vertices_mm=transform(X, points), faces=np.array(found.tri_verts, dtype=np.int64))
