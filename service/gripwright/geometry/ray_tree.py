"""First hits of many rays on a mesh with NumPy alone, for platforms without a wheel of Embree: the same hits, more slowly."""

import numpy as np
import numpy.typing as npt

from gripwright.domain.shape import FloatArray, IntArray

FACES_A_LEAF = 4
RAYS_A_BATCH = 32_768
EDGE_TOLERANCE = 1e-9
"""How far outside a face, in barycentric coordinates, a ray still meets it: no ray slips between two faces."""
BOX_SLACK = 1e-6
"""By how much boxes are larger than what they hold, as a fraction of the mesh's extent: flat ones have a thickness."""


class RayTree:
    """A binary tree of boxes over faces that are neighbours in space; all rays walk through it together, nearer boxes first.

    Node i has the children 2i + 1 and 2i + 2; each node of the last level holds `FACES_A_LEAF` places for faces. Points and
    vectors are columns, (3, …).
    """

    def __init__(self, vertices: npt.NDArray[np.float32], faces: IntArray, order: IntArray) -> None:
        """`order` (m,) of the faces, in which neighbours in space are neighbours."""
        self._depth = max(int(np.ceil(np.log2(len(faces) / FACES_A_LEAF))), 0)
        leaves = 2**self._depth
        leaf = np.arange(len(faces)) * leaves // len(faces)  # spread evenly; what is left of a leaf stays empty
        self._face = np.full(leaves * FACES_A_LEAF, -1)  # at each place
        self._face[leaf * FACES_A_LEAF + np.arange(len(faces)) - np.searchsorted(leaf, leaf)] = order
        a, b, c = (vertices[faces[self._face, k]].astype(np.float64).T for k in range(3))
        self._origin, self._u, self._v = a, b - a, c - a
        self._normal = _cross(self._u, self._v)
        empty = self._face < 0
        low = np.where(empty, np.inf, np.minimum(np.minimum(a, b), c)).reshape(3, leaves, FACES_A_LEAF).min(axis=2)
        high = np.where(empty, -np.inf, np.maximum(np.maximum(a, b), c)).reshape(3, leaves, FACES_A_LEAF).max(axis=2)
        lows, highs = [low], [high]
        while lows[-1].shape[1] > 1:
            lows.append(np.minimum(lows[-1][:, ::2], lows[-1][:, 1::2]))
            highs.append(np.maximum(highs[-1][:, ::2], highs[-1][:, 1::2]))
        slack = BOX_SLACK * np.ptp(vertices, axis=0).max()
        self._low, self._high = np.concatenate(lows[::-1], axis=1) - slack, np.concatenate(highs[::-1], axis=1) + slack

    def first_hits(
        self, origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int32], npt.NDArray[np.float32]]:
        """As `RayScene.first_hits`; of faces at one distance the first."""
        batches = (slice(i, i + RAYS_A_BATCH) for i in range(0, max(len(origins), 1), RAYS_A_BATCH))
        found = [self._walk(origins[part].T.astype(np.float64), directions[part].T.astype(np.float64)) for part in batches]
        distance, place = (np.concatenate(column) for column in zip(*found, strict=True))
        hit = place >= 0
        normal = np.where(hit, self._normal[:, place], 0.0).T
        return distance.astype(np.float32), np.where(hit, self._face[place], -1).astype(np.int32), normal.astype(np.float32)

    def _walk(self, origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance (r,) and place (r,), −1 for none, of the first hits; each ray has a stack of boxes that it enters."""
        count = origins.shape[1]
        inverse = 1.0 / np.where(directions == 0.0, np.finfo(np.float32).tiny, directions)
        best, place = np.full(count, np.inf), np.full(count, -1)
        stack = np.zeros((self._depth + 2, count), dtype=np.int64)
        entries = np.zeros((self._depth + 2, count))
        height = np.ones(count, dtype=np.int64)
        rays = np.arange(count)
        while rays.size:
            height[rays] -= 1
            near = entries[height[rays], rays] <= best[rays]
            ray = rays[near]
            node = stack[height[ray], ray]
            at_leaf = node >= 2**self._depth - 1
            self._meet_faces(ray[at_leaf], node[at_leaf] - (2**self._depth - 1), origins, directions, best, place)
            ray, parent = ray[~at_leaf], node[~at_leaf]
            left, right = (self._entry(2 * parent + k, origins[:, ray], inverse[:, ray]) for k in (1, 2))
            nearer = np.where(left <= right, 1, 2)
            for child, entry in ((3 - nearer, np.maximum(left, right)), (nearer, np.minimum(left, right))):
                enters = (entry <= best[ray]) & (entry < np.inf)
                top = ray[enters]
                stack[height[top], top], entries[height[top], top] = (2 * parent + child)[enters], entry[enters]
                height[top] += 1
            rays = rays[height[rays] > 0]
        return best, place

    def _entry(self, node: IntArray, origins: FloatArray, inverse: FloatArray) -> FloatArray:
        """Where rays enter the boxes of nodes, infinite where they miss them, (r,)."""
        low, high = (self._low[:, node] - origins) * inverse, (self._high[:, node] - origins) * inverse
        (a, b, c), (d, e, f) = np.minimum(low, high), np.maximum(low, high)
        enter, leave = np.maximum(np.maximum(a, b), np.maximum(c, 0.0)), np.minimum(np.minimum(d, e), f)
        return np.where(enter <= leave, enter, np.inf)

    def _meet_faces(
        self, rays: IntArray, leaf: IntArray, origins: FloatArray, directions: FloatArray, best: FloatArray, place: IntArray
    ) -> None:
        """Lower `best` and set `place` of rays at the faces of one leaf each."""
        for k in range(FACES_A_LEAF):
            at = leaf * FACES_A_LEAF + k
            distance = self._distance(at, origins[:, rays], directions[:, rays])
            as_near = (distance == best[rays]) & (distance < np.inf) & (self._face[at] < self._face[place[rays]])
            nearer = (distance < best[rays]) | as_near
            best[rays[nearer]], place[rays[nearer]] = distance[nearer], at[nearer]

    def _distance(self, at: IntArray, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """Lengths of the direction up to the face at each place, infinite where the ray misses it (Möller, Trumbore, 1997)."""
        u, v, away = self._u[:, at], self._v[:, at], origins - self._origin[:, at]
        across, turned = _cross(directions, v), _cross(away, u)
        with np.errstate(divide="ignore", invalid="ignore"):  # a ray along the plane of the face misses it
            scale = 1.0 / _dot(u, across)
            a, b, distance = _dot(away, across) * scale, _dot(directions, turned) * scale, _dot(v, turned) * scale
            inside = (a >= -EDGE_TOLERANCE) & (b >= -EDGE_TOLERANCE) & (a + b <= 1.0 + EDGE_TOLERANCE) & (distance >= 0.0)
        return np.where(inside & (self._face[at] >= 0), distance, np.inf)


def _cross(p: FloatArray, q: FloatArray) -> FloatArray:
    """Cross products of columns, (3, r)."""
    (a, b, c), (d, e, f) = p, q
    return np.stack((b * f - c * e, c * d - a * f, a * e - b * d))


def _dot(p: FloatArray, q: FloatArray) -> FloatArray:
    """Scalar products of columns, (r,)."""
    return np.asarray(p[0] * q[0] + p[1] * q[1] + p[2] * q[2])
