"""Stage 1: from the mesh of a file to the mesh that all other stages work on."""

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from gripwright.domain.shape import Mesh
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm
from gripwright.geometry.mesh_repair import Repair, repair, repaired
from gripwright.geometry.refine import refine, refined_face_count
from gripwright.geometry.thread_relief import levelled_mm, threads
from gripwright.plugin_api import Params, RunContext

__all__ = ["PrepareSettings", "Prepared", "prepare", "repaired"]

EDGE_GROWTH = 1.25


class PrepareSettings(Params):
    """How finely long triangles are divided."""

    edge: float = Field(0.04, gt=0.0, le=1.0, description="Longest edge, as a fraction of the mesh's extent.")
    growth: float = Field(2.0, ge=1.0, description="Meshes grow at most by this factor …")
    faces: int = Field(20_000, ge=1, description="… or to this number of faces; else longer edges stay.")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """A prepared mesh (see `Mesh`), the same solid with the file's own triangles, and what to tell the user about them."""

    mesh: Mesh
    solid: Mesh
    warnings: tuple[str, ...]


def prepare(mesh: Mesh, settings: PrepareSettings, ctx: RunContext) -> Prepared:
    """Repair and divide a mesh as read from a file (mm); `InvalidGeometry` where it cannot be used.

    Faces that have no three different corners have no successor in `source_faces`.
    """
    with ctx.timed("prepare.repair"):
        done = repair(mesh)
    ctx.progress(0.3, "mesh repaired")
    with ctx.timed("prepare.refine"):
        refined = refine(done.mesh, edge_max_mm(done.mesh, settings))
    if mesh.cad_faces is not None:
        refined = replace(refined, cad_faces=mesh.cad_faces[refined.source_faces])
    ctx.progress(0.6, "long triangles divided")
    with ctx.timed("prepare.smooth"):
        smooth = _with_level_threads(done.mesh, refined)
    return Prepared(mesh=smooth, solid=done.mesh, warnings=_warnings(done))


def _with_level_threads(solid: Mesh, refined: Mesh) -> Mesh:
    """The refined mesh with `smooth_vertices_mm` where the solid that it divides has screw threads; else as it is."""
    assert solid.source_faces is not None
    assert refined.source_faces is not None
    solid_face = np.searchsorted(solid.source_faces, refined.source_faces)  # of each refined face
    smooth = refined
    for thread in threads(solid):
        faces = np.flatnonzero(np.isin(solid_face, thread.faces))
        smooth = replace(smooth, vertices_mm=levelled_mm(smooth, replace(thread, faces=faces)))
    return refined if smooth is refined else replace(refined, smooth_vertices_mm=smooth.vertices_mm)


def edge_max_mm(mesh: Mesh, settings: PrepareSettings) -> float:
    """Longest edge that is left: the setting's, or longer where the mesh would grow too much."""
    longest = settings.edge * _extent_mm(mesh)
    limit = max(settings.growth * len(mesh.faces), settings.faces)
    while refined_face_count(mesh, longest) > limit:
        longest *= EDGE_GROWTH
    return longest


def _extent_mm(mesh: Mesh) -> float:
    """Twice the largest distance from the surface's centroid: unlike a bounding box it does not turn with the pose."""
    centroid = np.average(face_centres_mm(mesh), axis=0, weights=face_areas_mm2(mesh))
    return 2.0 * float(np.linalg.norm(mesh.vertices_mm - centroid, axis=1).max())


def _warnings(done: Repair) -> tuple[str, ...]:
    notes = (
        (done.degenerate_faces, "degenerate or double faces left out: {}"),
        (done.divided_faces, "faces divided where corners of others lie on their edges: {}"),
        (done.flipped_faces, "faces that were wound inwards turned round: {}"),
        (done.open_edges, "the mesh is open: {} edges have one face only"),
        (done.non_manifold_edges, "the mesh is not manifold: {} edges have more than two faces or faces of opposite sense"),
    )
    return tuple(text.format(count) for count, text in notes if count)
