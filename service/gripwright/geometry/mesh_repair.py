"""From the triangles of a file to a consistently wound surface: merged vertices, no degenerate faces, normals outward."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import IntArray, Mesh
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.measures import diagonal_mm, face_areas_mm2, face_cross_mm2, volume_mm3
from gripwright.geometry.winding import inward_faces

VOLUME_MIN = 1e-9
"""Smallest volume of a solid, as a fraction of the cube of its diagonal."""
OPEN_EDGES_MAX = 0.5
"""Largest fraction of edges that may have one face only."""
OPEN_AREA_MAX = 0.2
"""Largest sum of the area vectors (zero for a closed surface) as a fraction of the area."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repair:
    """A mesh fit for use and what had to be done or stays wrong. `mesh.source_faces` names the faces of the file."""

    mesh: Mesh
    degenerate_faces: int
    flipped_faces: int
    open_edges: int
    non_manifold_edges: int


def repaired(mesh: Mesh) -> Mesh:
    """The solid of a file's mesh with its own triangles: vertices merged, degenerate faces gone, normals outward."""
    return repair(mesh).mesh


def repair(mesh: Mesh) -> Repair:
    """Merge vertices, drop degenerate faces and turn faces outward; `InvalidGeometry` where no solid can be made of it."""
    _require_numbers(mesh)
    merged = _merge_vertices(mesh)
    kept = _distinct_faces(merged.faces)
    if not kept.size:
        raise InvalidGeometry("mesh has no surface: all faces are degenerate", faces=len(mesh.faces))
    distinct = _used_vertices(merged, kept)
    flips = inward_faces(distinct)
    faces = np.where(flips[:, None], distinct.faces[:, ::-1], distinct.faces)
    solid = Mesh(vertices_mm=distinct.vertices_mm, faces=faces, source_faces=kept)
    adjacency = face_adjacency(solid)
    _require_solid(solid, adjacency.open_edges)
    return Repair(
        mesh=solid,
        degenerate_faces=len(mesh.faces) - len(kept),
        flipped_faces=int(flips.sum()),
        open_edges=adjacency.open_edges,
        non_manifold_edges=adjacency.non_manifold_edges,
    )


def _require_numbers(mesh: Mesh) -> None:
    if not len(mesh.faces) or not len(mesh.vertices_mm):
        raise InvalidGeometry("mesh has no faces", faces=len(mesh.faces))
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices_mm):
        raise InvalidGeometry(
            f"a face names vertex {int(mesh.faces.max())}, the mesh has {len(mesh.vertices_mm)}", faces=len(mesh.faces)
        )
    wrong = int((~np.isfinite(mesh.vertices_mm).all(axis=1)).sum())
    if wrong:
        raise InvalidGeometry(f"{wrong} of {len(mesh.vertices_mm)} vertices are not finite numbers", vertices=wrong)


def _require_solid(mesh: Mesh, open_edges: int) -> None:
    """Refuse surfaces that enclose nothing."""
    edges = (3 * len(mesh.faces) + open_edges) / 2  # every other edge has two faces
    if open_edges > OPEN_EDGES_MAX * edges:
        raise InvalidGeometry(
            f"mesh is mostly open: {open_edges} of {edges:.0f} edges have one face, at most {OPEN_EDGES_MAX:.0%} are allowed",
            open_edges=open_edges,
        )
    area = float(face_areas_mm2(mesh).sum())
    gap = float(np.linalg.norm(face_cross_mm2(mesh).sum(axis=0) / 2.0)) / area if area > 0 else 1.0
    if gap > OPEN_AREA_MAX:
        raise InvalidGeometry(
            f"mesh is mostly open: {gap:.0%} of its area has nothing opposite, at most {OPEN_AREA_MAX:.0%} is allowed",
            open_edges=open_edges,
        )
    volume, limit = abs(volume_mm3(_centred(mesh))), VOLUME_MIN * diagonal_mm(mesh) ** 3
    if volume <= limit:
        raise InvalidGeometry(f"mesh encloses no volume: {volume:.3g} mm³, at least {limit:.3g} mm³ is needed", volume=volume)


def _merge_vertices(mesh: Mesh) -> Mesh:
    """Vertices of exactly equal coordinates become one, in order of first appearance."""
    points = mesh.vertices_mm + 0.0  # −0 becomes 0
    words = np.ascontiguousarray(points).view(np.uint64).reshape(-1, 3)  # (n, 3)
    mixed = (words * np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)).copy()
    mixed ^= mixed >> np.uint64(29)
    code = mixed[:, 0] ^ (mixed[:, 1] << np.uint64(1)) ^ (mixed[:, 2] << np.uint64(2))  # (n,)
    _, first, inverse = np.unique(code, return_index=True, return_inverse=True)
    if not np.array_equal(points[first[inverse]], points):  # two different points share a code
        _, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return Mesh(vertices_mm=points[first[order]], faces=rank[inverse.ravel()][mesh.faces].astype(np.int64))


def _distinct_faces(faces: IntArray) -> IntArray:
    """Faces with three different vertices, ascending; of faces with the same vertices one, none if they cancel out."""
    a, b, c = faces.T
    proper = np.flatnonzero((a != b) & (b != c) & (c != a))
    corners = np.sort(faces[proper], axis=1)
    count = int(faces.max()) + 1
    turn = ((a < b).astype(np.int64) + (b < c) + (c < a))[proper] * 2 - 3  # +1: an even permutation of the sorted corners
    if count < 2_000_000:  # count³ fits into 63 bits
        _, first, group = np.unique((corners[:, 0] * count + corners[:, 1]) * count + corners[:, 2], True, True)
    else:
        _, first, group = np.unique(corners, True, True, axis=0)
    if len(first) == len(proper):
        return proper
    net = np.bincount(group.ravel(), weights=turn, minlength=len(first)).astype(np.int64)  # winding of each set of corners
    wanted = np.flatnonzero(np.sign(net)[group.ravel()] == turn)
    _, chosen = np.unique(group.ravel()[wanted], return_index=True)
    return np.sort(proper[wanted[chosen]])


def _used_vertices(mesh: Mesh, faces: IntArray) -> Mesh:
    """The given faces with only the vertices that they use, in the same order."""
    used = np.zeros(len(mesh.vertices_mm), dtype=bool)
    used[mesh.faces[faces].ravel()] = True
    number = np.cumsum(used) - 1
    return Mesh(vertices_mm=mesh.vertices_mm[used], faces=number[mesh.faces[faces]])


def _centred(mesh: Mesh) -> Mesh:
    """The mesh about its bounding box's centre: volumes of open meshes then depend little on where it lies."""
    centre = (mesh.vertices_mm.min(axis=0) + mesh.vertices_mm.max(axis=0)) / 2.0
    return Mesh(vertices_mm=mesh.vertices_mm - centre, faces=mesh.faces)
