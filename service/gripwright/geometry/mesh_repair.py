"""From the triangles of a file to a consistently wound surface: merged vertices, no degenerate faces, no cracks at
T-junctions, normals outward."""

from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt

from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import IntArray, Mesh
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.measures import diagonal_mm, face_areas_mm2, face_cross_mm2, volume_mm3
from gripwright.geometry.t_junctions import without_t_junctions
from gripwright.geometry.winding import inward_faces

VOLUME_MIN = 1e-9
"""Smallest volume of a solid, as a fraction of the cube of its diagonal."""
OPEN_EDGES_MAX = 0.5
"""Largest fraction of edges that may have one face only."""
OPEN_AREA_MAX = 0.2
"""Largest sum of the area vectors (zero for a closed surface) as a fraction of the area."""
HASH_FACTORS = (np.uint64(0x9E3779B97F4A7C15), np.uint64(0xC2B2AE3D27D4EB4F), np.uint64(0x165667B19E3779F9))
"""Odd numbers whose bits look random: the upper bits of a product depend on all bits of the other factor."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repair:
    """A mesh fit for use and what had to be done or stays wrong. `mesh.source_faces` names the faces of the file."""

    mesh: Mesh
    degenerate_faces: int
    divided_faces: int  # along edges on which corners of other faces lie
    flipped_faces: int
    open_edges: int
    non_manifold_edges: int


def repaired(mesh: Mesh) -> Mesh:
    """The solid of a file's mesh with its own triangles: merged, without degenerate faces and T-junctions, normals outward."""
    return repair(mesh).mesh


def repair(mesh: Mesh) -> Repair:
    """Merge vertices, drop degenerate faces, close cracks at T-junctions, turn faces outward.

    `InvalidGeometry` where no solid can be made of it.
    """
    _require_numbers(mesh)
    merged = _merge_vertices(mesh)
    kept = _distinct_faces(merged.faces)
    if not kept.size:
        raise InvalidGeometry("mesh has no surface: all faces are degenerate", faces=len(mesh.faces))
    whole, divided = without_t_junctions(_used_vertices(merged, kept))
    flips = inward_faces(whole)
    faces = np.where(flips[:, None], whole.faces[:, ::-1], whole.faces)
    solid = Mesh(vertices_mm=whole.vertices_mm, faces=faces, source_faces=kept[whole.source_faces])
    adjacency = face_adjacency(solid)
    _require_solid(solid, adjacency.open_edges)
    return Repair(
        mesh=solid,
        degenerate_faces=len(mesh.faces) - len(kept),
        divided_faces=divided,
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
    points = np.ascontiguousarray(mesh.vertices_mm) + 0.0  # −0 becomes 0
    first, number = _equal_rows(points.view(np.uint64))
    return Mesh(vertices_mm=points[first], faces=number[mesh.faces])


def _distinct_faces(faces: IntArray) -> IntArray:
    """Faces with three different vertices, ascending; of faces with the same vertices one, none if they cancel out."""
    a, b, c = faces.T
    proper = np.flatnonzero((a != b) & (b != c) & (c != a))
    low, high = np.minimum(np.minimum(a, b), c)[proper], np.maximum(np.maximum(a, b), c)[proper]
    corners = np.stack((low, (a + b + c)[proper] - low - high, high), axis=1)
    first, group = _equal_rows(corners.view(np.uint64))
    if len(first) == len(proper):
        return proper
    turn = ((a < b).astype(np.int64) + (b < c) + (c < a))[proper] * 2 - 3  # +1: an even permutation of the sorted corners
    net = np.bincount(group, weights=turn, minlength=len(first)).astype(np.int64)  # winding of each set of corners
    wanted = np.flatnonzero(np.sign(net)[group] == turn)
    _, chosen = np.unique(group[wanted], return_index=True)
    return np.sort(proper[wanted[chosen]])


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _equal_rows(rows: npt.NDArray[np.uint64]) -> tuple[IntArray, IntArray]:
    """The first of each set of equal rows (k, 3), ascending, and the number of each row's set, (k,): a hash table."""
    size = 1
    while size < 2 * len(rows):
        size *= 2
    table = np.full(size, -1, dtype=np.int64)  # number of the set found at a place
    first, number = np.empty(len(rows), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
    found = 0
    for i in range(len(rows)):
        x, y, z = rows[i, 0], rows[i, 1], rows[i, 2]
        code = x * HASH_FACTORS[0] ^ y * HASH_FACTORS[1] ^ z * HASH_FACTORS[2]
        code = (code ^ (code >> np.uint64(32))) * HASH_FACTORS[0]
        place = np.int64((code ^ (code >> np.uint64(29))) & np.uint64(size - 1))
        while table[place] >= 0:
            other = first[table[place]]
            if rows[other, 0] == x and rows[other, 1] == y and rows[other, 2] == z:
                break
            place = (place + 1) & (size - 1)
        if table[place] < 0:
            table[place] = found
            first[found] = i
            found += 1
        number[i] = table[place]
    return first[:found].copy(), number


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
