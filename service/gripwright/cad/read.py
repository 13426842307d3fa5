"""CAD files to meshes. Runs in the child process alone (cad/child.py): the files are others' and the parsers are C++."""

from dataclasses import replace

import numpy as np

from gripwright.cad.gltf import read_glb
from gripwright.cad.limits import DEFAULT_LIMITS, Limits
from gripwright.cad.part21 import check_frame
from gripwright.cad.ply import read_ply
from gripwright.cad.polygons import read_obj, read_off
from gripwright.cad.stl import read_stl
from gripwright.cad.threemf import read_3mf
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import Mesh
from gripwright.geometry.codec import MM_PER_UNIT, mesh_in_mm
from gripwright.geometry.measures import diagonal_mm, face_areas_mm2

DIAGONAL_MIN_MM = 1e-2
DIAGONAL_MAX_MM = 1e5
_UNITLESS_READERS = {"stl": read_stl, "obj": read_obj, "off": read_off, "ply": read_ply}


def read_mesh(data: bytes, format: str, units: str | None, limits: Limits = DEFAULT_LIMITS) -> Mesh:
    """The mesh of a CAD file in mm, its faces in the file's order, polygons as fans; equal vertices are one.

    `format` as cad/formats names it. `units` (mm, cm, m, in) says what the file's numbers mean; None where the format
    says so itself. A glTF file's metres are a convention that exporters ignore, so there `units` outranks it; a STEP or
    3MF file states its unit, which `units` must not contradict. Axes stay as they are in every format.
    """
    if format in _UNITLESS_READERS:
        if units is None:
            raise InvalidGeometry(f"states no units: {format.upper()} does not carry them")
        mesh = mesh_in_mm(*_UNITLESS_READERS[format](data), units)
    elif format == "step":  # Open CASCADE takes half a second to import: not for files that need none
        check_frame(data)
        from gripwright.cad.step import read_step_mesh

        mesh = read_step_mesh(data, units, limits)
    elif format == "glb":
        mesh = mesh_in_mm(*read_glb(data, limits), units or "m")
    else:
        polygons, unit = read_3mf(data, limits)
        if units is not None and MM_PER_UNIT[units] != MM_PER_UNIT[unit]:
            raise InvalidGeometry(f"states its numbers in {unit}, but units says {units}")
        mesh = mesh_in_mm(*polygons, unit)
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
    keys = np.zeros(len(corners), dtype=np.int64)  # rank of each corner, coordinate by coordinate: faster than by rows
    for coordinate in corners.T:
        values, ranks = np.unique(coordinate, return_inverse=True)
        _, first, keys = np.unique(keys * len(values) + ranks, return_index=True, return_inverse=True)
    return replace(mesh, vertices_mm=corners[first], faces=keys.reshape(-1, 3).astype(np.int64))
