"""First hits of many rays on a mesh: by Embree, or by NumPy on platforms that its wheels leave out."""

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.ray_tree import RayTree

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:
    EMBREE = False
else:
    EMBREE = True

FloatArray32 = npt.NDArray[np.float32]
IntArray32 = npt.NDArray[np.int32]

CROSSINGS_MAX = 256
"""A ray's crossings are counted up to this number."""


class Tracer(Protocol):
    """What finds the first hits in a scene."""

    def first_hits(self, origins: FloatArray32, directions: FloatArray32) -> tuple[FloatArray32, IntArray32, FloatArray32]:
        """As `RayScene.first_hits`."""
        ...


class EmbreeTree:
    """Embree's scene of one mesh."""

    def __init__(self, vertices: FloatArray32, faces: IntArray) -> None:
        self._scene = EmbreeScene(robust=True)
        self._mesh = TriangleMesh(self._scene, vertices, np.ascontiguousarray(faces, dtype=np.int32))
        # Embree builds its tree at the first query; do it here, before threads share the scene.
        self.first_hits(np.zeros((1, 3), dtype=np.float32), np.ones((1, 3), dtype=np.float32))

    def first_hits(self, origins: FloatArray32, directions: FloatArray32) -> tuple[FloatArray32, IntArray32, FloatArray32]:
        """As `RayScene.first_hits`."""
        found = self._scene.run(origins, directions, output=True)
        return found["tfar"], found["primID"], found["Ng"]


class RayScene:
    """A mesh to shoot rays at.

    Embree works in single precision: the scene keeps its own centre, so that a mesh far from the origin loses nothing.
    """

    def __init__(self, vertices_mm: FloatArray, faces: IntArray) -> None:
        self.centre_mm: FloatArray = (vertices_mm.min(axis=0) + vertices_mm.max(axis=0)) / 2.0
        self._tree: Tracer = (
            EmbreeTree(self.centred(vertices_mm), faces)
            if EMBREE
            else RayTree(self.centred(vertices_mm), faces, morton_order(vertices_mm[faces].mean(axis=1)))
        )

    def centred(self, points_mm: FloatArray) -> FloatArray32:
        """Points as the scene sees them, about its centre."""
        return np.ascontiguousarray(points_mm - self.centre_mm, dtype=np.float32)

    def first_hits(self, origins_mm: FloatArray32, directions: FloatArray32) -> tuple[FloatArray32, IntArray32, FloatArray32]:
        """First hit of each ray (r, 3), origins as `centred` gives them.

        Distance in lengths of the direction (r,), face (r,) −1 where nothing is hit, and the face's normal, not a unit (r, 3).
        """
        return self._tree.first_hits(origins_mm, directions)

    def crossings(self, origins_mm: FloatArray, directions: FloatArray, step_mm: float) -> IntArray:
        """How often each ray (r, 3) crosses the surface, (r,). Rays begin `step_mm` ahead, and so they do after each crossing."""
        unit = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
        points = self.centred(origins_mm) + np.float32(step_mm) * unit
        count = np.zeros(len(points), dtype=np.int64)
        alive = np.arange(len(points))
        for _ in range(CROSSINGS_MAX):
            distance, face, _ = self.first_hits(points[alive], unit[alive])
            hit = face >= 0
            alive = alive[hit]
            if not alive.size:
                break
            count[alive] += 1
            points[alive] += (distance[hit, None] + np.float32(step_mm)) * unit[alive]
        return count


def cores() -> int:
    """Number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def chunks(count: int, size: int) -> Iterator[slice]:
    """Consecutive slices of at most `size` items."""
    return (slice(i, min(i + size, count)) for i in range(0, count, size))


def thread_pool() -> ThreadPoolExecutor:
    """Threads for work that releases the interpreter's lock: one a core."""
    return ThreadPoolExecutor(max_workers=cores())


def morton_order(points: FloatArray) -> IntArray:
    """An order of points (n, 3) in which neighbours in space are mostly neighbours in memory."""
    columns = points.T
    low = np.array([x.min() for x in columns])
    span = max(float(max(np.ptp(x) for x in columns)), np.finfo(float).tiny)
    code = np.zeros(len(points), dtype=np.uint32)
    for axis, x in enumerate(columns):
        cell = ((x - low[axis]) / span * 1023.0).astype(np.uint32)  # (n,), 10 bits
        for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
            cell = (cell | (cell << np.uint32(shift))) & np.uint32(mask)
        code |= cell << np.uint32(axis)
    order = np.argsort((code & np.uint32(0x7FFF)).astype(np.uint16), kind="stable")  # 16 bits at a time: a radix sort
    return order[np.argsort((code >> np.uint32(15)).astype(np.uint16)[order], kind="stable")]
