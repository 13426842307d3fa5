"""A mesh's surface as segmenters see it: areas, edges with their angles, and even samples of it."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import connected_labels, edge_lengths_mm, exterior_angles_rad, face_adjacency
from gripwright.geometry.bends import bends_rad
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, face_cross_mm2
from gripwright.geometry.rays import morton_order
from gripwright_builtin.segmenters.energy import SMOOTH_RAD, border_shares

REACH = 0.04
"""How far to either side of an edge its surroundings go, as a fraction of the square root of the surface's area."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """What the shape of a mesh says about borders between its faces."""

    areas_mm2: FloatArray  # (m,)
    area_vectors_mm2: FloatArray  # (m, 3) outward normal times area
    pairs: IntArray  # (e, 2) faces
    angles_rad: FloatArray  # (e,) exterior
    bends_rad: FloatArray  # (e,) exterior, of the edge and what is around it
    lengths_mm: FloatArray  # (e,)
    shares: FloatArray  # (e,) cost of a border for its length


def surface_of(mesh: Mesh) -> Surface:
    """Measure a mesh with merged vertices."""
    adjacency = face_adjacency(mesh)
    area_vectors = face_cross_mm2(mesh) / 2.0
    areas = np.linalg.norm(area_vectors, axis=1)
    angles = exterior_angles_rad(mesh, adjacency, area_vectors)
    normals = area_vectors / np.maximum(areas, np.finfo(float).tiny)[:, None]
    bends = bends_rad(mesh, adjacency, angles, normals, REACH * float(np.sqrt(areas.sum())))
    return Surface(
        areas_mm2=areas,
        area_vectors_mm2=area_vectors,
        pairs=adjacency.pairs,
        angles_rad=angles,
        bends_rad=bends,
        lengths_mm=edge_lengths_mm(mesh, adjacency),
        shares=border_shares(angles, bends),
    )


def sampled_faces(mesh: Mesh, count: int) -> IntArray:
    """At most `count` faces, ascending, that are spread over the surface by area; all where there are no more."""
    if len(mesh.faces) <= count:
        return np.arange(len(mesh.faces))
    order = morton_order(face_centres_mm(mesh))
    covered = np.cumsum(face_areas_mm2(mesh)[order])
    step = np.minimum(np.floor(covered / covered[-1] * count), count - 1.0)
    return np.sort(order[np.diff(step, prepend=-1.0) > 0])


def surface_groups(mesh: Mesh, surface: Surface, count: int) -> IntArray:
    """Number of each face's group, (m,): the faces of one smooth patch in one cube, of which there are about `count`."""
    centres = face_centres_mm(mesh)
    side = np.sqrt(surface.areas_mm2.sum() / count)
    cells = np.floor((centres - centres.min(axis=0)) / side).astype(np.int64)  # (m, 3)
    patch = connected_labels(surface.pairs[np.abs(surface.angles_rad) < SMOOTH_RAD], len(centres))
    key = patch
    for axis in range(3):
        key = key * (int(cells[:, axis].max()) + 1) + cells[:, axis]
    return np.unique(key, return_inverse=True)[1]
