"""Meshes that a file places, once or many times, as one mesh."""

from collections.abc import Sequence

import numpy as np

from gripwright.cad.limits import Limits
from gripwright.cad.polygons import Polygons
from gripwright.domain.errors import LimitExceeded
from gripwright.domain.shape import FloatArray

Placed = tuple[FloatArray, Polygons]
"""Where a mesh stands, any affine X (4, 4), and the mesh; the same object wherever it is the same mesh."""


class Placements:
    """Collects placements within the limits of instances and triangles, which grow by powers where files nest."""

    def __init__(self, limits: Limits) -> None:
        self._limits, self._placed, self._triangles, self._visits = limits, list[Placed](), 0, 0

    def visit(self, depth: int) -> None:
        """Count one step of the structure, `depth` levels down."""
        self._visits += 1
        if self._visits > self._limits.max_instances:
            raise LimitExceeded(f"places more than {self._limits.max_instances} parts, at most {self._limits.max_instances}")
        if depth > self._limits.max_levels:
            raise LimitExceeded(f"nests its parts {depth} levels deep or more, at most {self._limits.max_levels}")

    def add(self, X: FloatArray, mesh: Polygons) -> None:
        """Place a mesh."""
        self._triangles += len(mesh[1])
        if self._triangles > self._limits.max_triangles:
            raise LimitExceeded(f"holds {self._triangles} triangles or more, at most {self._limits.max_triangles}")
        self._placed.append((X, mesh))

    def polygons(self) -> Polygons:
        """All of it as one mesh, in the order in which it was placed."""
        return _joined(self._placed)


def _joined(placed: Sequence[Placed]) -> Polygons:
    vertices, faces, offset = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for X, (points, triangles) in placed:
        own, turned = points, triangles
        if not np.array_equal(X, np.eye(4)):
            own = points @ X[:3, :3].T + X[:3, 3]
            if np.linalg.det(X[:3, :3]) < 0:
                turned = triangles[:, ::-1]  # a mirrored instance winds the other way
        vertices.append(own)
        faces.append(turned + offset)
        offset += len(own)
    return np.concatenate(vertices), np.concatenate(faces)
