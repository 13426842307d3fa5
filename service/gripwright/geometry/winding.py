"""Which faces of a surface have to be turned round so that all look outward.

Faces that meet at an edge decide about each other. A whole body, the faces that so hang together, is turned only where the
shape says so: a closed one by the sign of its volume, an open one by how often rays from its faces cross the surface.
"""

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import connected_labels, open_bodies, two_face_edges
from gripwright.geometry.measures import diagonal_mm, face_areas_mm2, face_normals
from gripwright.geometry.rays import RayScene

WITNESSES, WITNESSES_A_FACE = 256, 4
"""Rays that judge an open body, each from an equal part of its area; fewer where it has few faces."""
ORIGIN_OFFSET = 1e-5
"""How far from the surface rays begin, as a fraction of the diagonal."""
TILT = 0.3
"""Part of a ray's direction that is not along the normal, for each another one, so that few rays meet edges."""


def inward_faces(mesh: Mesh) -> BoolArray:
    """Which faces of a mesh with merged vertices look inward, (m,): turned round, every body is consistent and looks outward."""
    pairs, against = two_face_edges(mesh)
    body = connected_labels(pairs, len(mesh.faces))
    flips = np.zeros(len(mesh.faces), dtype=bool) if against.all() else _inconsistent(mesh, pairs, against, body)
    wound = Mesh(vertices_mm=mesh.vertices_mm, faces=np.where(flips[:, None], mesh.faces[:, ::-1], mesh.faces))
    closed = 2 * len(pairs) == 3 * len(mesh.faces)
    is_open = np.zeros(int(body.max()) + 1, dtype=bool) if closed else open_bodies(mesh, body)
    return np.asarray(flips ^ _inside_out_bodies(wound, body, is_open)[body])


def _inconsistent(mesh: Mesh, pairs: IntArray, against: BoolArray, body: IntArray) -> BoolArray:
    """The smaller part of each body's area, (m,), that runs against the rest of it.

    Each face stands for two nodes, as it is and turned round; pairs link those that agree.
    """
    m = len(mesh.faces)
    f, g = pairs.T
    same = np.where(against, 0, m)
    links = np.concatenate((np.stack((f, g + same), axis=1), np.stack((f + m, (g + m + same) % (2 * m)), axis=1)))
    side = connected_labels(links, 2 * m)
    one_sided = side[:m] == side[m:]  # a Möbius band: nothing to decide
    turned = (side[:m] > side[m:]) & ~one_sided
    area = face_areas_mm2(mesh)
    turned_area = np.bincount(body, weights=area * turned)
    return np.asarray((turned ^ (2.0 * turned_area > np.bincount(body, weights=area))[body]) & ~one_sided)


def _inside_out_bodies(mesh: Mesh, body: IntArray, is_open: BoolArray) -> BoolArray:
    """Which bodies have to be turned round, (bodies,): closed ones of negative volume, open ones whose rays say so.

    A closed body inside another one is turned with the largest body that contains it: a cavity stays a cavity.
    """
    corners = mesh.triangles_mm - (mesh.vertices_mm.min(axis=0) + mesh.vertices_mm.max(axis=0)) / 2.0
    a, b, c = np.moveaxis(corners, 1, 0)
    volumes = np.bincount(body, weights=np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0).astype(np.float64)
    turned = volumes < 0
    faces = np.split(np.argsort(body, kind="stable"), np.cumsum(np.bincount(body))[:-1])  # of each body
    if is_open.any():
        turned[is_open] = _look_inward(mesh, [faces[i] for i in np.flatnonzero(is_open)])
    return _with_their_containers(corners, faces, volumes, turned, is_open) if turned.any() else turned


def _with_their_containers(
    corners: FloatArray, faces: list[IntArray], volumes: FloatArray, turned: BoolArray, is_open: BoolArray
) -> BoolArray:
    """`turned` (bodies,) with the verdict on each closed body inside another one replaced by that on the outermost."""
    points = [corners[f].reshape(-1, 3) for f in faces]
    low, high = np.array([p.min(axis=0) for p in points]), np.array([p.max(axis=0) for p in points])
    result = turned.copy()
    for i in np.argsort(-np.abs(volumes), kind="stable"):
        boxes = np.flatnonzero((low <= low[i]).all(axis=1) & (high >= high[i]).all(axis=1) & (np.abs(volumes) > abs(volumes[i])))
        around = [] if is_open[i] else [j for j in boxes if abs(_turns_around(points[i][0], corners[faces[j]])) > 0.5]
        if around:
            result[i] = result[max(around, key=lambda j: abs(volumes[j]))]
    return np.asarray(result)


def _look_inward(mesh: Mesh, bodies: list[IntArray]) -> BoolArray:
    """Whether most of the faces of each body have material ahead of them, (bodies,).

    A ray that leaves the solid crosses its surface an even number of times, one that enters it an odd number; this does not
    depend on how faces are wound. Faces whose two rays do not differ, because one found a gap, say nothing.
    """
    areas = face_areas_mm2(mesh)
    faces = [_spread(body, areas) for body in bodies]
    chosen, body = np.concatenate(faces), np.repeat(np.arange(len(bodies)), [len(f) for f in faces])
    lean = np.random.default_rng(0).normal(size=(len(chosen), 3))
    directions = face_normals(mesh)[chosen] + lean * (TILT / np.linalg.norm(lean, axis=1, keepdims=True))
    origins, step = mesh.triangles_mm[chosen].mean(axis=1), ORIGIN_OFFSET * diagonal_mm(mesh)
    scene = RayScene(mesh.vertices_mm, mesh.faces)
    ahead, behind = (scene.crossings(origins, side * directions, step) % 2 for side in (1.0, -1.0))
    return np.asarray(np.bincount(body, weights=ahead - behind, minlength=len(bodies)) > 0)


def _spread(faces: IntArray, areas: FloatArray) -> IntArray:
    """A face from each of equally large parts of the area of `faces`."""
    covered = np.cumsum(areas[faces])
    count = min(WITNESSES, WITNESSES_A_FACE * len(faces))
    return np.asarray(faces[np.searchsorted(covered, (np.arange(count) + 0.5) / count * covered[-1]).clip(max=len(faces) - 1)])


def _turns_around(point: FloatArray, triangles: FloatArray) -> float:
    """Winding number of a surface about a point: ±1 inside a closed one, 0 outside (van Oosterom and Strackee, 1983)."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)  # (k, 3) each
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    dots = np.einsum("ij,ij->i", a, b) * lc + np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    return float(np.arctan2(triple, la * lb * lc + dots).sum() / (2.0 * np.pi))
