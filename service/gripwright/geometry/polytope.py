"""Convex solids as their faces, still and swept along a straight displacement."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from gripwright.domain.shape import FloatArray, IntArray

_FLAT = 1e-9  # faces of a hull whose normals differ by less are one face that Qhull has triangulated
_STANDING_MM = 1e-12  # so short a way leads nowhere; squares of much shorter ones are 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Faces:
    """A convex solid: normal · p ≤ offset for each face (lengths in mm, unit normals), and its bounding box."""

    normals: FloatArray  # (f, 3)
    offsets: FloatArray  # (f,)
    low: FloatArray  # (3,)
    high: FloatArray  # (3,)


class Polytope:
    """The convex hull of points (n, 3) as its faces, and as the edges between them, from which its sweeps are told."""

    def __init__(self, points: FloatArray) -> None:
        hull = ConvexHull(points)
        normals = hull.equations[:, :3]  # (s, 3), a triangle each
        self.vertices: FloatArray = points[hull.vertices]
        kept = _first_of_each(normals)
        self.faces = _faces(self.vertices, normals[kept])
        rows, sides = np.nonzero(np.arange(len(normals))[:, None] < hull.neighbors)  # neighbour k lies opposite corner k
        other = hull.neighbors[rows, sides]
        bent = np.abs(normals[rows] - normals[other]).max(axis=1) > _FLAT
        rows, sides, other = rows[bent], sides[bent], other[bent]
        ends = points[hull.simplices[rows[:, None], (sides[:, None] + [1, 2]) % 3]]  # (e, 2, 3)
        self._edges, self._edge_points = ends[:, 1] - ends[:, 0], ends[:, 0]
        self._beside = normals[rows], normals[other]

    def swept(self, displacement: FloatArray) -> Faces:
        """All places of the solid while it moves by a displacement (3,): Minkowski sum with a segment.

        A face that looks along the displacement goes with it; between faces that look along it and faces that look against it
        each edge sweeps a face of its own.
        """
        if not np.abs(displacement).max() > _STANDING_MM:
            return self.faces
        along = self.faces.normals @ displacement  # (f,)
        first, second = (normals @ displacement for normals in self._beside)
        outline = first * second <= 0.0
        (a, b, c), (x, y, z) = self._edges[outline].T, displacement
        normals = np.column_stack([b * z - c * y, c * x - a * z, a * y - b * x])
        size = np.sqrt((normals * normals).sum(axis=1))
        swept = size > 1e-12 * float(np.sqrt(displacement @ displacement))
        normals = normals[swept] / size[swept, None]
        levels = (normals * self._edge_points[outline][swept]).sum(axis=1)
        reach = self.vertices @ normals.T  # (n, e)
        inwards = reach.max(axis=0) - levels > levels - reach.min(axis=0)  # an edge lies on its face
        normals = np.where(inwards[:, None], -normals, normals)
        offsets = np.where(inwards, -levels, levels)
        return Faces(
            normals=np.concatenate([self.faces.normals, normals]),
            offsets=np.concatenate([self.faces.offsets + np.maximum(along, 0.0), offsets]),
            low=self.faces.low + np.minimum(displacement, 0.0),
            high=self.faces.high + np.maximum(displacement, 0.0),
        )


def _faces(vertices: FloatArray, normals: FloatArray) -> Faces:
    return Faces(normals=normals, offsets=(vertices @ normals.T).max(axis=0), low=vertices.min(axis=0), high=vertices.max(axis=0))


def _first_of_each(normals: FloatArray) -> IntArray:
    """Rows of normals (s, 3), one for each face."""
    alike = np.abs(normals[:, None] - normals[None]).max(axis=2) <= _FLAT  # (s, s)
    return np.flatnonzero(alike.argmax(axis=1) == np.arange(len(normals)))
