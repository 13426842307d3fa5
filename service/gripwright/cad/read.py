"""CAD files to meshes. Runs in the child process alone (cad/child.py): the files are others' and the parsers are C++."""

import io

import numpy as np
import trimesh

from gripwright.cad.archive import open_archive
from gripwright.cad.formats import STATES_UNITS
from gripwright.cad.limits import DEFAULT_LIMITS, Limits
from gripwright.cad.ply import read_ply
from gripwright.cad.polygons import read_obj, read_off
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.codec import MM_PER_UNIT, mesh_in_mm
from gripwright.geometry.measures import diagonal_mm, face_areas_mm2

DIAGONAL_MIN_MM = 1e-2
DIAGONAL_MAX_MM = 1e5
_POLYGON_READERS = {"obj": read_obj, "off": read_off, "ply": read_ply}
_UNIT_NAMES = {"millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "in", "foot": "ft", "micron": "micron"}


def read_mesh(data: bytes, format: str, units: str | None, limits: Limits = DEFAULT_LIMITS) -> Mesh:
    """The mesh of a CAD file in mm, its faces in the file's order, polygons as fans; equal vertices are one.

    `format` as cad/formats names it. `units` (mm, cm, m, in) says what the file's numbers mean; None where the format
    says so itself. A glTF file's metres are a convention that exporters ignore, so there `units` outranks it; a STEP or
    3MF file states its unit, which `units` must not contradict. Axes stay as they are in every format.
    """
    if format == "step":
        from gripwright.cad.step import read_step_mesh  # half a second that mesh files need not wait

        mesh = read_step_mesh(data, units)
    elif format in _POLYGON_READERS:
        mesh = mesh_in_mm(*_POLYGON_READERS[format](data), _stated(format, units))
    else:
        if format == "3mf":
            open_archive(data, "its archive", limits)
        scene = trimesh.load_scene(io.BytesIO(data), file_type=format, process=False)
        vertices, faces = _concatenated(scene)
        mesh = mesh_in_mm(vertices, faces, _unit_of_scene(scene, format, units))
    return merged(checked(mesh))


def checked(mesh: Mesh) -> Mesh:
    """The mesh, or InvalidGeometry where nothing can be computed on it."""
    if len(mesh.faces) == 0:
        raise InvalidGeometry("holds no triangle")
    if not np.isfinite(mesh.vertices_mm).all():
        bad = int((~np.isfinite(mesh.vertices_mm)).any(axis=1).sum())
        raise InvalidGeometry(f"holds {bad} vertices whose coordinates are not numbers (NaN or infinite)")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices_mm):
        raise InvalidGeometry(f"holds triangles of vertices that it does not have (it has {len(mesh.vertices_mm)})")
    used = Mesh(vertices_mm=mesh.triangles_mm.reshape(-1, 3), faces=mesh.faces)
    diagonal = diagonal_mm(used)
    if not DIAGONAL_MIN_MM <= diagonal <= DIAGONAL_MAX_MM:
        bounds = f"from {DIAGONAL_MIN_MM:g} to {DIAGONAL_MAX_MM:g} mm"
        raise InvalidGeometry(f"measures {diagonal:.4g} mm across, must be {bounds}: are the units right?")
    if not (face_areas_mm2(mesh) > 0).any():
        raise InvalidGeometry("holds no triangle that has an area")
    return mesh


def merged(mesh: Mesh) -> Mesh:
    """The same faces in the same order, vertices of exactly equal coordinates made one, unused ones dropped."""
    corners = mesh.triangles_mm.reshape(-1, 3) + 0.0  # −0 becomes 0
    vertices, inverse = np.unique(corners, axis=0, return_inverse=True)
    return Mesh(vertices_mm=vertices, faces=inverse.reshape(-1, 3).astype(np.int64))


def _stated(format: str, units: str | None) -> str:
    if units is None:
        raise InvalidGeometry(f"units absent: {format.upper()} does not carry them")
    return units


def _unit_of_scene(scene: trimesh.Scene, format: str, units: str | None) -> str:
    if format not in STATES_UNITS:
        return _stated(format, units)
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
