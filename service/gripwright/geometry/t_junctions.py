"""Cracks closed where an edge of one face runs along several of other faces: corners that lie on an open edge divide its face."""

import numpy as np
from scipy.spatial import cKDTree

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import open_half_edges
from gripwright.geometry.measures import diagonal_mm

TOLERANCE = 1e-6
"""How far from an edge a corner on it may lie, as a fraction of the diagonal: rounding of CAD files."""
PASSES = 6
"""A face is divided along one of its edges at a time."""


def without_t_junctions(mesh: Mesh) -> tuple[Mesh, int]:
    """The mesh with faces divided at the corners on their open edges, and how many faces were; no vertex moves.

    `source_faces` of the result are faces of the mesh given. Its vertices must be merged.
    """
    faces, source, divided = mesh.faces, np.arange(len(mesh.faces)), 0
    for _ in range(PASSES):
        current = Mesh(vertices_mm=mesh.vertices_mm, faces=faces)
        chains = _chains(current)
        if not chains:
            break
        divided += len(chains)
        kept = np.ones(len(faces), dtype=bool)
        kept[list(chains)] = False
        pieces = [_fan(faces[face], chain) for face, chain in chains.items()]
        owners = np.repeat(source[list(chains)], [len(piece) for piece in pieces])
        faces, source = np.concatenate((faces[kept], *pieces)), np.concatenate((source[kept], owners))
    order = np.argsort(source, kind="stable")
    return Mesh(vertices_mm=mesh.vertices_mm, faces=faces[order], source_faces=source[order]), divided


def _chains(mesh: Mesh) -> dict[int, IntArray]:
    """Of each face with corners of others on an open edge: the vertices along that edge, in the sense of the face."""
    ends, face = open_half_edges(mesh)
    if not len(ends):
        return {}
    corners = np.unique(ends)
    points, tolerance = mesh.vertices_mm, TOLERANCE * diagonal_mm(mesh)
    lengths = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
    near = cKDTree(points[corners]).query_ball_point(points[ends].mean(axis=1), lengths / 2.0)
    chains: dict[int, IntArray] = {}
    for (a, b), owner, found in zip(ends, face, near, strict=True):
        between = _on_segment(points, int(a), int(b), corners[found], tolerance)
        if len(between) and (owner not in chains or len(between) > len(chains[owner]) - 2):
            chains[int(owner)] = np.concatenate(([a], between, [b]))
    return chains


def _on_segment(points: FloatArray, a: int, b: int, candidates: IntArray, tolerance: float) -> IntArray:
    """Those of the vertices that lie strictly between a and b, from a to b."""
    way = points[b] - points[a]
    length = float(np.linalg.norm(way))
    if length <= 2.0 * tolerance:
        return candidates[:0]
    offset = points[candidates] - points[a]
    along = offset @ way / length
    off = np.linalg.norm(offset - np.outer(along, way / length), axis=1)
    on = (off <= tolerance) & (along > tolerance) & (along < length - tolerance)
    return np.asarray(candidates[on][np.argsort(along[on], kind="stable")])


def _fan(face: IntArray, chain: IntArray) -> IntArray:
    """Triangles (k, 3) from the corner of a face that is not on the chain to each link of the chain."""
    apex = face[(face != chain[0]) & (face != chain[-1])][0]
    return np.stack((chain[:-1], chain[1:], np.full(len(chain) - 1, apex)), axis=1)
