"""Which faces of a mesh meet at an edge, and at what angle."""

from dataclasses import dataclass

import numba
import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.measures import face_normals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Adjacency:
    """Pairs of faces that share an edge.

    An edge of two faces gives one pair. An edge where more faces meet gives pairs that bound the same wedge of material,
    so that two solids that touch along an edge stay apart; what cannot be paired so is open there.
    """

    pairs: IntArray  # (e, 2) faces
    edges: IntArray  # (e, 2) vertices, in the direction in which the first face of the pair runs through them
    open_edges: int  # edges of one face
    non_manifold_edges: int  # edges of more than two faces, or of two that do not run against each other


def face_adjacency(mesh: Mesh) -> Adjacency:
    """The pairs of faces of a mesh with merged vertices."""
    halves, order, start, count = _half_edges_by_edge(mesh)
    first, second = order[start[count == 2]], order[start[count == 2] + 1]
    against = halves[first, 0] == halves[second, 1]
    pairs = [np.stack((first, second), axis=1)[against]]  # half-edges; face of half-edge h is h % m
    many = np.flatnonzero(count > 2)
    if many.size:
        pairs.append(_wedge_pairs(mesh, halves, [order[start[i] : start[i] + count[i]] for i in many]))
    half_pairs = np.concatenate(pairs)  # (e, 2)
    return Adjacency(
        pairs=half_pairs % len(mesh.faces),
        edges=halves[half_pairs[:, 0]],
        open_edges=int((count == 1).sum()),
        non_manifold_edges=int(many.size + (~against).sum()),
    )


def two_face_edges(mesh: Mesh) -> tuple[IntArray, BoolArray]:
    """Pairs of faces at edges of exactly two faces, (e, 2), and whether they run against each other there, (e,)."""
    halves, order, start, count = _half_edges_by_edge(mesh)
    first, second = order[start[count == 2]], order[start[count == 2] + 1]
    return np.stack((first, second), axis=1) % len(mesh.faces), halves[first, 0] == halves[second, 1]


def open_half_edges(mesh: Mesh) -> tuple[IntArray, IntArray]:
    """Edges of one face only, (k, 2) vertices in the sense of the face, and that face, (k,)."""
    halves, order, start, count = _half_edges_by_edge(mesh)
    single = order[start[count == 1]]
    return halves[single], single % len(mesh.faces)


def open_bodies(mesh: Mesh, body: IntArray) -> BoolArray:
    """Which bodies (bodies,), `body` (m,) naming that of each face, have an edge with an odd number of their own faces."""
    _, order, start, count = _half_edges_by_edge(mesh)
    edge = np.repeat(np.arange(len(start)), count)
    bodies = int(body.max()) + 1
    key, times = np.unique(edge * bodies + body[order % len(mesh.faces)], return_counts=True)
    is_open = np.zeros(bodies, dtype=bool)
    is_open[key[times % 2 == 1] % bodies] = True
    return is_open


def exterior_angles_rad(mesh: Mesh, adjacency: Adjacency, normals: FloatArray | None = None) -> FloatArray:
    """Angle by which the surface turns at each edge, (e,): 0 flat, positive convex, negative concave, at most π.

    `normals` (m, 3), of whatever length, if known.
    """
    normals = face_normals(mesh) if normals is None else normals
    return np.asarray(_exterior_angles(mesh.vertices_mm, adjacency.edges, adjacency.pairs, normals))


def edge_lengths_mm(mesh: Mesh, adjacency: Adjacency) -> FloatArray:
    """Length of the edge of each pair, (e,)."""
    ends = mesh.vertices_mm[adjacency.edges]  # (e, 2, 3)
    return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))


def connected_labels(pairs: IntArray, count: int) -> IntArray:
    """Number of the connected component of each of `count` items linked by `pairs`, (count,), from 0."""
    return np.asarray(_component_labels(pairs, count))


def neighbour_lists(pairs: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Items paired with item f are `neighbour[start[f] : start[f + 1]]`."""
    return _neighbour_lists(pairs, count)  # type: ignore[no-any-return]


def _half_edges_by_edge(mesh: Mesh) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Half-edges (3m, 2), their order by undirected edge, and start and count of each edge in that order."""
    return _sorted_half_edges(np.ascontiguousarray(mesh.faces), len(mesh.vertices_mm))  # type: ignore[no-any-return]


def _wedge_pairs(mesh: Mesh, halves: IntArray, edges: list[IntArray]) -> IntArray:
    """Pairs of half-edges, (k, 2), that bound one wedge of material, at edges of more than two faces."""
    pairs: list[tuple[int, int]] = []
    for group in edges:
        origin, end = mesh.vertices_mm[halves[group].min(axis=1)[0]], mesh.vertices_mm[halves[group].max(axis=1)[0]]
        along = (end - origin) / max(float(np.linalg.norm(end - origin)), np.finfo(float).tiny)
        faces = mesh.faces[group % len(mesh.faces)]  # (k, 3)
        away = mesh.vertices_mm[faces].mean(axis=1) - origin  # (k, 3)
        away = away - np.outer(away @ along, along)
        x = away[0] / max(float(np.linalg.norm(away[0])), np.finfo(float).tiny)
        angle = np.arctan2(away @ np.cross(along, x), away @ x) % (2 * np.pi)
        # A face that runs along the edge has its outside ahead in the sense of growing angle, its material behind.
        forward = halves[group, 0] < halves[group, 1]
        pairs += _pair_around(group[np.argsort(angle, kind="stable")], forward[np.argsort(angle, kind="stable")])
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _pair_around(group: IntArray, forward: BoolArray) -> list[tuple[int, int]]:
    """Neighbours in the order around an edge of which the first begins a wedge of material and the second ends it."""
    pairs = []
    for i in range(len(group)):
        j = (i + 1) % len(group)
        if not forward[i] and forward[j]:
            pairs.append((int(group[j]), int(group[i])))
    return pairs


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _sorted_half_edges(faces: IntArray, vertices: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Two counting sorts, by the higher end and then, stably, by the lower one; both linear in the number of faces."""
    m = len(faces)
    halves = np.empty((3 * m, 2), dtype=np.int64)
    places = np.zeros((2, vertices + 1), dtype=np.int64)  # of the next half-edge with that lower and that higher end
    for h in range(3 * m):
        a, b = faces[h % m, h // m], faces[h % m, (h // m + 1) % 3]
        halves[h, 0], halves[h, 1] = a, b
        places[0, min(a, b) + 1] += 1
        places[1, max(a, b) + 1] += 1
    places[0], places[1] = np.cumsum(places[0]), np.cumsum(places[1])
    by_higher, order = np.empty(3 * m, dtype=np.int64), np.empty(3 * m, dtype=np.int64)
    for h in range(3 * m):
        v = max(halves[h, 0], halves[h, 1])
        by_higher[places[1, v]] = h
        places[1, v] += 1
    for half in by_higher:
        v = min(halves[half, 0], halves[half, 1])
        order[places[0, v]] = half
        places[0, v] += 1
    start, edges = np.empty(3 * m, dtype=np.int64), 0
    for i in range(3 * m):
        a, b = halves[order[i], 0], halves[order[i], 1]
        c, d = halves[order[i - 1], 0], halves[order[i - 1], 1]
        if i == 0 or min(a, b) != min(c, d) or max(a, b) != max(c, d):
            start[edges] = i
            edges += 1
    start = start[:edges].copy()
    return halves, order, start, np.diff(np.append(start, 3 * m))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _neighbour_lists(pairs: IntArray, count: int) -> tuple[IntArray, IntArray]:
    start = np.zeros(count + 1, dtype=np.int64)
    for i in range(len(pairs)):
        start[pairs[i, 0] + 1] += 1
        start[pairs[i, 1] + 1] += 1
    start = np.cumsum(start)
    place, neighbour = start[:-1].copy(), np.empty(2 * len(pairs), dtype=np.int64)
    for end in range(2):
        for i in range(len(pairs)):
            item = pairs[i, end]
            neighbour[place[item]] = pairs[i, 1 - end]
            place[item] += 1
    return start, neighbour


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _component_labels(pairs: IntArray, count: int) -> IntArray:
    """Connected components by union-find; the root of a tree is its first item, so that labels follow first appearance."""
    root = np.arange(count)
    for i in range(len(pairs)):
        a, b = pairs[i, 0], pairs[i, 1]
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        root[max(a, b)] = min(a, b)
    labels = np.empty(count, dtype=np.int64)
    found = 0
    for i in range(count):
        if root[i] == i:
            labels[i] = found
            found += 1
        else:
            labels[i] = labels[root[i]]
    return labels


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _exterior_angles(vertices: FloatArray, edges: IntArray, pairs: IntArray, normals: FloatArray) -> FloatArray:
    result = np.empty(len(pairs))
    for i in range(len(pairs)):
        n, o = normals[pairs[i, 0]], normals[pairs[i, 1]]
        p, q = vertices[edges[i, 0]], vertices[edges[i, 1]]
        x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        length = np.sqrt(x * x + y * y + z * z)
        triple = x * (n[1] * o[2] - n[2] * o[1]) + y * (n[2] * o[0] - n[0] * o[2]) + z * (n[0] * o[1] - n[1] * o[0])
        sine = triple / length if length > 0.0 else 0.0
        result[i] = np.arctan2(sine, n[0] * o[0] + n[1] * o[1] + n[2] * o[2])
    return result
