"""3MF and GLB through trimesh: scenes of placed meshes. Runs in the child process alone."""

import io

import numpy as np
import trimesh

from gripwright.cad.archive import open_archive
from gripwright.cad.limits import Limits
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.codec import MM_PER_UNIT, mesh_in_mm

_UNIT_NAMES = {"millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "in", "foot": "ft", "micron": "micron"}


def read_scene_mesh(data: bytes, format: str, units: str | None, limits: Limits) -> Mesh:
    """All meshes of the scene in its own frame as one, mm. What `units` may say is in cad/read.py."""
    if format == "3mf":
        open_archive(data, "its archive", limits)
    scene = trimesh.load_scene(io.BytesIO(data), file_type=format, process=False)
    vertices, faces = _concatenated(scene)
    return mesh_in_mm(vertices, faces, _unit_of(scene, format, units))


def _unit_of(scene: trimesh.Scene, format: str, units: str | None) -> str:
    if format == "glb":
        return units or "m"
    name = str(scene.units or "millimeter").lower().removesuffix("s")
    unit = _UNIT_NAMES.get(name)
    if unit is None:
        raise InvalidGeometry(f"states the unit {name!r}, which 3MF does not have")
    if units is not None and MM_PER_UNIT[units] != MM_PER_UNIT[unit]:
        raise InvalidGeometry(f"states its numbers in {unit}, but units says {units}")
    return unit


def _concatenated(scene: trimesh.Scene) -> tuple[FloatArray, IntArray]:
    """All meshes of a scene in its own frame, in the file's order."""
    vertices, faces, offset = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for node in scene.graph.nodes_geometry:
        X, name = scene.graph[node]
        geometry = scene.geometry[name]
        if not isinstance(geometry, trimesh.Trimesh):
            continue  # lines and points have no surface
        own = np.asarray(geometry.vertices, dtype=np.float64)
        turned = np.asarray(geometry.faces, dtype=np.int64)
        if not np.array_equal(X, np.eye(4)):
            own = own @ X[:3, :3].T + X[:3, 3]
            if np.linalg.det(X[:3, :3]) < 0:
                turned = turned[:, ::-1]  # a mirrored instance winds the other way
        vertices.append(own)
        faces.append(turned + offset)
        offset += len(own)
    return np.concatenate(vertices), np.concatenate(faces)
