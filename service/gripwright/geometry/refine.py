"""Division of long triangles. No vertex moves, and every new face lies in one face of the mesh that was divided."""

import numba
import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.measures import face_areas_mm2

AREA_SHARE, LENGTH_SHARE = 8.0, 2.8
"""Faces that come of a square, and of a length, of the longest edge: fitted to CAD meshes."""


def refine(mesh: Mesh, edge_max_mm: float) -> Mesh:
    """The mesh with every edge longer than `edge_max_mm` halved until none is; works on open and non-manifold meshes.

    Both faces of an edge are divided at the same point, so that no gap opens. Faces are ordered by `source_faces`.
    """
    vertices = mesh.vertices_mm
    source = np.arange(len(mesh.faces)) if mesh.source_faces is None else mesh.source_faces
    done: list[tuple[IntArray, IntArray]] = []
    faces = mesh.faces
    while True:
        long = _squared_sides(vertices, np.ascontiguousarray(faces)) > edge_max_mm**2  # (m, 3)
        divided = long.any(axis=1)
        done.append((faces[~divided], source[~divided]))
        if not divided.any():
            break
        faces, source, vertices = _halve(vertices, faces[divided], source[divided], long[divided])
    all_faces, all_source = np.concatenate([f for f, _ in done]), np.concatenate([s for _, s in done])
    order = np.argsort(all_source, kind="stable")
    return Mesh(vertices_mm=vertices, faces=all_faces[order], source_faces=all_source[order])


def refined_face_count(mesh: Mesh, edge_max_mm: float) -> float:
    """Estimate of the number of faces after `refine`, good to a factor of about 1.5."""
    a, b, c = _squared_sides(mesh.vertices_mm, np.ascontiguousarray(mesh.faces)).T
    longest = np.sqrt(np.maximum(np.maximum(a, b), c))  # (m,)
    long = np.flatnonzero(longest > edge_max_mm)
    across = AREA_SHARE * face_areas_mm2(mesh)[long] / edge_max_mm**2
    along = LENGTH_SHARE * longest[long] / edge_max_mm
    return float(len(mesh.faces) + (across + along).sum())


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _squared_sides(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Squared lengths of the sides, (m, 3); side k runs from corner k to k + 1."""
    result = np.empty((len(faces), 3))
    for f in range(len(faces)):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            x, y, z = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
            result[f, k] = x * x + y * y + z * z
    return result


def _halve(vertices: FloatArray, faces: IntArray, source: IntArray, long: BoolArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Divide faces at the middles of their long sides: into 2, 3 or 4."""
    ends = np.stack((faces, faces[:, [1, 2, 0]]), axis=2)[long]  # (l, 2)
    key = ends.min(axis=1) * len(vertices) + ends.max(axis=1)
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    middle = np.full(faces.shape, -1)
    middle[long] = len(vertices) + inverse
    vertices = np.concatenate((vertices, vertices[ends[first]].mean(axis=1)))
    count = long.sum(axis=1)
    # Turn each face so that its sides lie alike: one long side first; two long sides last; three anyhow.
    turn = np.where(count == 1, long.argmax(axis=1), np.where(count == 2, ((~long).argmax(axis=1)), 0))
    columns = (turn[:, None] + np.arange(3)) % 3
    corner, middle = np.take_along_axis(faces, columns, axis=1), np.take_along_axis(middle, columns, axis=1)
    pieces, owners = [], []
    for pattern, divide in ((1, _into_two), (2, _into_three), (3, _into_four)):
        chosen = count == pattern
        new = divide(vertices, corner[chosen], middle[chosen])
        pieces.append(new.reshape(-1, 3))
        owners.append(np.repeat(source[chosen], new.shape[1]))
    return np.concatenate(pieces), np.concatenate(owners), vertices


def _into_two(vertices: FloatArray, corner: IntArray, middle: IntArray) -> IntArray:
    """Side 0 is long. (k, 2, 3)."""
    del vertices
    a, b, c = corner.T
    p = middle[:, 0]
    return np.stack((a, p, c, p, b, c), axis=1).reshape(-1, 2, 3)


def _into_three(vertices: FloatArray, corner: IntArray, middle: IntArray) -> IntArray:
    """Sides 1 and 2 are long; the remaining four-sided piece is divided along its shorter diagonal. (k, 3, 3)."""
    a, b, c = corner.T
    p, q = middle[:, 1], middle[:, 2]
    along_ap = np.linalg.norm(vertices[a] - vertices[p], axis=1) <= np.linalg.norm(vertices[b] - vertices[q], axis=1)
    with_ap = np.stack((c, q, p, a, b, p, a, p, q), axis=1)
    with_bq = np.stack((c, q, p, a, b, q, b, p, q), axis=1)
    return np.where(along_ap[:, None], with_ap, with_bq).reshape(-1, 3, 3)


def _into_four(vertices: FloatArray, corner: IntArray, middle: IntArray) -> IntArray:
    """All sides are long. (k, 4, 3)."""
    del vertices
    a, b, c = corner.T
    p, q, r = middle.T
    return np.stack((a, p, r, p, b, q, r, q, c, p, q, r), axis=1).reshape(-1, 4, 3)
