"""How far a surface turns across an edge and what is around it: a crease is one whether it is sharp, blurred or a fillet."""

import numba
import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import Adjacency

SHARP_RAD = np.radians(60.0)
"""An edge that turns more is a crease by itself: no walk goes on across it, and what lies beside it stays smooth."""
FLAT_RAD = np.radians(1.0)
"""An edge that turns less is not in the middle of a bend: no walk begins there."""
STEPS_MAX = 200
"""Faces that one walk may cross."""
PARTS = 16
"""Pieces of the work that the threads share."""


def bends_rad(mesh: Mesh, adjacency: Adjacency, angles_rad: FloatArray, normals: FloatArray, reach_mm: float) -> FloatArray:
    """Turn of the surface from one side of each edge to the other, (e,): positive convex, negative concave.

    A walk leads from the edge's middle straight over the surface, square to the edge, `reach_mm` to either side or to a sharp
    edge. It sums the turns of the edges it crosses (`angles_rad` (e,), exterior), an edge at the end of the reach counting
    nothing and the edge itself in full. Where the walk turns both ways, the part of it that turns farthest counts: a low step
    has a crease and a convex edge. An edge that hardly turns itself has no bend. `normals` (m, 3) are units.
    """
    ways = _ways(mesh.vertices_mm, np.ascontiguousarray(normals), adjacency.pairs, adjacency.edges, angles_rad)
    return np.asarray(_bends(mesh.vertices_mm, adjacency.pairs, adjacency.edges, angles_rad, *ways, reach_mm, PARTS))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _ways(
    vertices: FloatArray, normals: FloatArray, pairs: IntArray, edges: IntArray, angles: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Where one gets from each face through each of its up to three edges: the edge (m, 3), −1 for none; the face beyond and
    the edge's place there (m, 3, 2); the unit vector square to the edge and away from the face, the edge's coordinate along
    it, and the turn at the edge (m, 3, 5)."""
    m = len(normals)
    edge_of, beyond, planes = np.full((m, 3), -1), np.zeros((m, 3, 2), dtype=np.int64), np.zeros((m, 3, 5))
    count = np.zeros(m, dtype=np.int64)
    for e in range(len(pairs)):
        f, g = pairs[e, 0], pairs[e, 1]
        places = (count[f], count[g])
        ax, ay, az = vertices[edges[e, 0]]
        bx, by, bz = vertices[edges[e, 1]]
        x, y, z = bx - ax, by - ay, bz - az
        for k in range(2):
            face, place = pairs[e, k], places[k]
            nx, ny, nz = normals[face]
            ox, oy, oz = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
            length = np.sqrt(ox * ox + oy * oy + oz * oz)
            scale = (1.0 if k == 0 else -1.0) / length if length > 0.0 else 0.0
            ox, oy, oz = ox * scale, oy * scale, oz * scale
            edge_of[face, place] = e
            beyond[face, place, 0], beyond[face, place, 1] = pairs[e, 1 - k], places[1 - k]
            plane = planes[face, place]
            plane[0], plane[1], plane[2], plane[3], plane[4] = ox, oy, oz, ax * ox + ay * oy + az * oz, angles[e]
            count[face] += 1
    return edge_of, beyond, planes


@numba.njit(cache=True, parallel=True, nogil=True)  # type: ignore[untyped-decorator]
def _bends(
    vertices: FloatArray,
    pairs: IntArray,
    edges: IntArray,
    angles: FloatArray,
    edge_of: IntArray,
    beyond: IntArray,
    planes: FloatArray,
    reach: float,
    parts: int,
) -> FloatArray:
    count = len(pairs)
    result = np.empty(count)
    for part in numba.prange(parts):
        for e in range(part * count // parts, (part + 1) * count // parts):
            result[e] = angles[e]
            if abs(angles[e]) < FLAT_RAD:
                continue
            concave, convex = angles[e], angles[e]
            x = (vertices[edges[e, 0], 0] + vertices[edges[e, 1], 0]) / 2.0
            y = (vertices[edges[e, 0], 1] + vertices[edges[e, 1], 1]) / 2.0
            z = (vertices[edges[e, 0], 2] + vertices[edges[e, 1], 2]) / 2.0
            for side in range(2):
                face = pairs[e, side]
                place = 0 if edge_of[face, 0] == e else 1 if edge_of[face, 1] == e else 2
                low, high = _walk(x, y, z, face, place, beyond, edge_of, planes, reach)
                concave += low
                convex += high
            result[e] = concave if -concave > convex else convex
    return result


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _walk(
    x: float, y: float, z: float, face: int, place: int, beyond: IntArray, edge_of: IntArray, planes: FloatArray, reach: float
) -> tuple[float, float]:
    """Least and largest partial sum of the turns, from a point on the edge at `place` of `face` on into the face."""
    ux, uy, uz = -planes[face, place, 0], -planes[face, place, 1], -planes[face, place, 2]
    walked, total, low, high = 0.0, 0.0, 0.0, 0.0
    for _ in range(STEPS_MAX):
        way, step, speed = -1, reach - walked, 0.0
        for k in range(3):
            if k == place or edge_of[face, k] < 0:
                continue
            plane = planes[face, k]
            towards = ux * plane[0] + uy * plane[1] + uz * plane[2]
            if towards <= 1e-9:
                continue
            gap = (plane[3] - x * plane[0] - y * plane[1] - z * plane[2]) / towards
            if gap < step:
                way, step, speed = k, max(gap, 0.0), towards
        if way < 0 or abs(planes[face, way, 4]) > SHARP_RAD:
            break
        walked += step
        x, y, z = x + step * ux, y + step * uy, z + step * uz
        out = planes[face, way]
        total += out[4] * speed * (1.0 - walked / reach)
        low, high = min(low, total), max(high, total)
        face, place = beyond[face, way, 0], beyond[face, way, 1]
        back = planes[face, place]
        ux -= speed * (out[0] + back[0])
        uy -= speed * (out[1] + back[1])
        uz -= speed * (out[2] + back[2])
    return low, high
