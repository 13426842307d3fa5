"""How far a mesh reaches into a convex solid: the least shift along the normal of a face that leads its part out again."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, Mesh
from gripwright.geometry.clipping import corners_within
from gripwright.geometry.collision import winding_numbers
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.polytope import Polytope
from gripwright.geometry.solids import is_box


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Penetration:
    """Of a mesh into a convex solid, in the solid's frame.

    Of the mesh's solid all that lies within the convex one would have to move (or be cut away) by `depth_mm` through the face of
    that outward normal. What lies outside of it is not looked at: a larger shift may meet it.
    """

    depth_mm: float
    normal: FloatArray  # (3,) of the face with the least depth
    deepest: FloatArray  # (3,) the point that lies farthest behind that face


class Halfspaces:
    """A convex solid as its faces: normal · p ≤ offset."""

    def __init__(self, vertices: FloatArray) -> None:
        self.vertices = vertices
        self.normals: FloatArray = (
            np.concatenate([np.eye(3), -np.eye(3)]) if is_box(vertices) else Polytope(vertices).faces.normals
        )
        self.offsets: FloatArray = (vertices @ self.normals.T).max(axis=0)  # (f,)


class Triangles:
    """A mesh's triangles with their bounding boxes, ready for many solids."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh, self.corners = mesh, mesh.triangles_mm  # (m, 3, 3)
        self.low, self.high = self.corners.min(axis=1), self.corners.max(axis=1)  # (m, 3)

    def within(self, solid: Halfspaces, X_SM: FloatArray) -> FloatArray:
        """Corners of what of them lies within the solid, (k, 3) in its frame."""
        around = transform(inverse(X_SM), solid.vertices)
        near = (self.high >= around.min(axis=0)) & (self.low <= around.max(axis=0))
        part = transform(X_SM, self.corners[near.all(axis=1)])
        return corners_within(part, solid.normals, solid.offsets)


def penetration(solid: Halfspaces, triangles: Triangles, X_SM: FloatArray) -> Penetration | None:
    """How far the mesh at pose `X_SM` reaches into the solid; None where nothing of it lies within."""
    corners = solid.vertices[_inside(triangles.mesh, transform(inverse(X_SM), solid.vertices))]
    # The corners of what both solids share: where surfaces lie within the solid, and the solid's own within the mesh.
    return _least(solid, np.concatenate([triangles.within(solid, X_SM), corners]))


def surface_penetration(solid: Halfspaces, triangles: Triangles, X_SM: FloatArray) -> Penetration | None:
    """How far the mesh's surface reaches into the solid, at most as far as the mesh does: soon told."""
    return _least(solid, triangles.within(solid, X_SM))


def _least(solid: Halfspaces, points: FloatArray) -> Penetration | None:
    if not len(points):
        return None
    levels = points @ solid.normals.T  # (n, f)
    depths = solid.offsets - levels.min(axis=0)
    face = int(np.argmin(np.round(depths, 3)))  # of equal ones the first, whatever the rounding
    return Penetration(
        depth_mm=max(0.0, float(depths[face])),
        normal=solid.normals[face],
        deepest=points[int(np.argmin(levels[:, face]))],
    )


def _inside(mesh: Mesh, points: FloatArray) -> BoolArray:
    """Whether points (n, 3) lie inside the mesh, by their winding numbers."""
    low, high = mesh.vertices_mm.min(axis=0), mesh.vertices_mm.max(axis=0)
    near = ((points > low) & (points < high)).all(axis=1)
    inside = np.zeros(len(points), dtype=bool)
    inside[near] = np.abs(winding_numbers(mesh, points[near])) > 0.5
    return inside
