"""Closed and open triangle meshes: how near two of them come, and whether one is inside the other."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import fcl
import numpy as np
import trimesh
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
MM_PER_UNIT = {"um": 0.001, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "inch": 25.4, "ft": 304.8}


def load_mesh(path: Path, units: str = "mm") -> trimesh.Trimesh:
    """The file's surface in mm, vertices merged, faces wound outwards where it is closed."""
    mesh = trimesh.load(path, force="mesh")
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise ValueError(f"{path.name} holds no triangles")
    mesh.apply_scale(MM_PER_UNIT[units])
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def placed(mesh: trimesh.Trimesh, pose: Array) -> trimesh.Trimesh:
    """A copy of the mesh at the pose."""
    return trimesh.Trimesh(mesh.vertices @ pose[:3, :3].T + pose[:3, 3], mesh.faces, process=False)


def winding_numbers(points: Array, mesh: trimesh.Trimesh) -> Array:
    """How often the surface winds around each point (n, 3): 1 inside, 0 outside, between the two near holes of an open mesh."""
    numbers = np.zeros(len(points))
    for i, point in enumerate(points):
        a, b, c = np.moveaxis(mesh.vertices[mesh.faces] - point, 1, 0)  # (m, 3) each
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        triple = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
        solid_angles = 2 * np.arctan2(triple, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
        numbers[i] = solid_angles.sum() / (4 * np.pi)
    return numbers


class Shape:
    """Some solids, fixed to each other, ready for distance queries."""

    def __init__(self, solids: Sequence[trimesh.Trimesh]) -> None:
        self.solids = list(solids)
        self.vertices: Array = np.vstack([solid.vertices for solid in self.solids])
        offsets = np.cumsum([0] + [len(solid.vertices) for solid in self.solids[:-1]])
        faces = np.vstack([solid.faces + offset for solid, offset in zip(self.solids, offsets, strict=True)])
        self._model = fcl.BVHModel()
        self._model.beginModel(len(faces), len(self.vertices))
        self._model.addSubModel(self.vertices, faces)
        self._model.endModel()

    def distance(self, other: Shape, pose: Array | None = None) -> float:
        """Smallest distance between the two surfaces, this one moved by `pose`; 0 where they cut each other."""
        mine = fcl.CollisionObject(self._model, _transform(np.eye(4) if pose is None else pose))
        theirs = fcl.CollisionObject(other._model, _transform(np.eye(4)))
        if fcl.collide(mine, theirs, fcl.CollisionRequest(), fcl.CollisionResult()):
            return 0.0
        return max(0.0, float(fcl.distance(mine, theirs, fcl.DistanceRequest(), fcl.DistanceResult())))

    @cached_property
    def shell_points(self) -> list[Array]:
        """One vertex of each connected piece of surface, (pieces, 3) for each solid."""
        points = []
        for solid in self.solids:
            labels = trimesh.graph.connected_component_labels(solid.face_adjacency, node_count=len(solid.faces))
            _, firsts = np.unique(labels, return_index=True)
            points.append(np.asarray(solid.vertices[solid.faces[firsts, 0]]))
        return points

    def is_inside(self, other: Shape, pose: Array | None = None) -> bool:
        """Whether, surfaces being apart, some piece of one lies inside a solid of the other."""
        pose = np.eye(4) if pose is None else pose
        return _has_inside(self, other, pose) or _has_inside(other, self, np.linalg.inv(pose))


def _has_inside(pieces: Shape, solids: Shape, pose: Array) -> bool:
    points = np.vstack(pieces.shell_points) @ pose[:3, :3].T + pose[:3, 3]
    for solid in solids.solids:
        candidates = points[((points > solid.bounds[0]) & (points < solid.bounds[1])).all(axis=1)]
        if (np.abs(winding_numbers(candidates, solid)) > 0.5).any():
            return True
    return False


def _transform(pose: Array) -> Any:
    return fcl.Transform(np.ascontiguousarray(pose[:3, :3]), np.ascontiguousarray(pose[:3, 3]))
