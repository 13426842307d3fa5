"""True corners of tessellated surfaces: vertices on the surface itself, not on the chords of its facets. Compiled."""

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.facets import COPLANAR_RAD

_STRAIGHT_RAD = 0.02  # by which the angles of one facet around a vertex may miss a half turn


def corner_vertices(mesh: Mesh, vertices: IntArray) -> IntArray:
    """Those of the given vertices that are corners of the planar patches they lie on, ascending.

    A tessellated curved surface has its corners on the true surface; vertices put inside its facets or along their edges
    (by refinement, say) lie on chords and would bias a fit.
    """
    local = np.full(len(mesh.vertices_mm), -1, dtype=np.int64)
    local[vertices] = np.arange(len(vertices))
    return np.sort(vertices[corner_mask(mesh.vertices_mm, mesh.faces, local, len(vertices))])


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def corner_mask(vertices: FloatArray, faces: IntArray, local: IntArray, count: int) -> BoolArray:
    """Which vertices are corners, (count,); `local` numbers those that are asked for, the others are −1."""
    start, star = _faces_around(faces, local, count)
    widest = 1
    for v in range(count):
        widest = max(widest, start[v + 1] - start[v])
    normals, spokes, wedges = np.empty((widest, 3)), np.empty((widest, 2), np.int64), np.empty((widest, 2))
    parent = np.empty(widest, np.int64)
    mask = np.zeros(count, np.bool_)
    for v in range(count):
        degree = 0
        for at in range(start[v], start[v + 1]):
            face, corner = star[at] // 3, star[at] % 3
            here, ahead, behind = faces[face, corner], faces[face, (corner + 1) % 3], faces[face, (corner + 2) % 3]
            if _wedge(vertices, here, ahead, behind, normals[degree], wedges[degree]):
                spokes[degree, 0], spokes[degree, 1] = ahead, behind
                degree += 1
        mask[v] = _is_corner(normals, spokes, wedges, parent, degree)
    return mask


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _faces_around(faces: IntArray, local: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Corners (3 · face + corner) at vertex v are `star[start[v] : start[v + 1]]`."""
    start = np.zeros(count + 2, np.int64)
    for f in range(len(faces)):
        for k in range(3):
            if local[faces[f, k]] >= 0:
                start[local[faces[f, k]] + 2] += 1
    for v in range(count):
        start[v + 2] += start[v + 1]
    star = np.empty(start[count + 1], np.int64)
    for f in range(len(faces)):
        for k in range(3):
            v = local[faces[f, k]]
            if v >= 0:
                star[start[v + 1]] = 3 * f + k
                start[v + 1] += 1
    return start[: count + 1], star


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _wedge(vertices: FloatArray, here: int, ahead: int, behind: int, normal: FloatArray, wedge: FloatArray) -> bool:
    """Write a face's unit normal, and sine and cosine (times the same) of its angle at a vertex; False without area."""
    ax, ay, az = (
        vertices[ahead, 0] - vertices[here, 0],
        vertices[ahead, 1] - vertices[here, 1],
        vertices[ahead, 2] - vertices[here, 2],
    )
    bx, by, bz = (
        vertices[behind, 0] - vertices[here, 0],
        vertices[behind, 1] - vertices[here, 1],
        vertices[behind, 2] - vertices[here, 2],
    )
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        return False
    normal[0], normal[1], normal[2] = nx / length, ny / length, nz / length
    wedge[0], wedge[1] = length, ax * bx + ay * by + az * bz
    return True


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _is_corner(normals: FloatArray, spokes: IntArray, wedges: FloatArray, parent: IntArray, degree: int) -> bool:
    """Whether the faces of one plane, joined over shared edges, leave a corner: less than a half turn."""
    for a in range(degree):
        parent[a] = a
    for a in range(degree):
        for b in range(a):
            joined = spokes[a, 0] == spokes[b, 1] or spokes[a, 1] == spokes[b, 0]
            if joined or spokes[a, 0] == spokes[b, 0] or spokes[a, 1] == spokes[b, 1]:
                x, y, z = normals[a, 0] - normals[b, 0], normals[a, 1] - normals[b, 1], normals[a, 2] - normals[b, 2]
                if x * x + y * y + z * z < COPLANAR_RAD * COPLANAR_RAD:
                    ra, rb = a, b
                    while parent[ra] != ra:
                        ra = parent[ra]
                    while parent[rb] != rb:
                        rb = parent[rb]
                    parent[max(ra, rb)] = min(ra, rb)
    for a in range(degree):  # the root of a group comes first
        if parent[a] == a:
            total = 0.0
            for b in range(a, degree):
                root = b
                while parent[root] != root:
                    root = parent[root]
                if root == a:
                    total += np.arctan2(wedges[b, 0], wedges[b, 1])
            if total < np.pi - _STRAIGHT_RAD:
                return True
    return False
