"""Collision of convex solids with triangle meshes, by FCL, with one cached bounding volume hierarchy a mesh.

FCL takes meshes as surfaces: a solid wholly inside a mesh is "free". Whoever needs an answer about solids asks `inside` too.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

import fcl
import numpy as np
from numba import njit
from scipy.spatial import ConvexHull

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.rooms import Rooms, rooms
from gripwright.geometry.solids import is_box
from gripwright.geometry.triangle_blocks import TriangleBlocks
from gripwright.geometry.withdrawal import Passage, Shrinking

_REQUEST = fcl.CollisionRequest()
_ROUNDING_MM = 1e-3  # more than FCL's distances are off


class ConvexShape:
    """The convex hull of some points as an FCL geometry, with its bounding box for quick rejection.

    `offset`: where its frame has the origin of the FCL geometry; None: in its own origin.
    """

    def __init__(self, vertices: FloatArray) -> None:
        self.vertices = vertices
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        self.centre: FloatArray = (low + high) / 2.0
        self.half: FloatArray = (high - low) / 2.0
        if is_box(vertices):
            self._geometry = fcl.Box(*(high - low))
            self.offset: FloatArray | None = self.centre
        else:
            self._geometry = _convex_geometry(vertices)
            self.offset = None
        self._object = fcl.CollisionObject(self._geometry)

    def placed(self, X: FloatArray) -> fcl.CollisionObject:
        """The FCL object at a pose; the same object each time."""
        translation = X[:3, 3] if self.offset is None else X[:3, :3] @ self.offset + X[:3, 3]
        self._object.setTransform(fcl.Transform(X[:3, :3], translation))
        return self._object


def _convex_geometry(vertices: FloatArray) -> fcl.Convex:
    hull = ConvexHull(vertices)
    corners = vertices[hull.vertices]
    index = np.zeros(len(vertices), dtype=int)
    index[hull.vertices] = np.arange(len(hull.vertices))
    faces = index[hull.simplices]  # (f, 3)
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inwards] = faces[inwards][:, [0, 2, 1]]
    return fcl.Convex(corners, len(faces), np.column_stack([np.full(len(faces), 3), faces]).ravel())


class MeshSurface:
    """A mesh's bounding volume hierarchy, built once, when it is first needed; place it as often as needed."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        low, high = mesh.vertices_mm.min(axis=0), mesh.vertices_mm.max(axis=0)
        self.bounds: tuple[FloatArray, FloatArray] = ((low + high) / 2.0, (high - low) / 2.0)  # centre, half extents

    @cached_property
    def geometry(self) -> fcl.BVHModel:
        """The hierarchy: most of what stands far away is never asked about."""
        model = fcl.BVHModel()
        model.beginModel(len(self.mesh.vertices_mm), len(self.mesh.faces))
        model.addSubModel(self.mesh.vertices_mm, self.mesh.faces)
        model.endModel()
        return model

    @cached_property
    def blocks(self) -> TriangleBlocks:
        """The triangles in blocks, for solids that shrink."""
        return TriangleBlocks(self.mesh)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedSurface:
    """A surface that stands at a pose of some frame, and its name for messages."""

    name: str
    surface: MeshSurface
    X: FloatArray  # (4, 4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Watch:
    """The boxes that a scene is asked about: only bodies whose bounding boxes meet one of them have a say in the answer."""

    scene: "Scene"
    low: list[FloatArray] = field(default_factory=list)  # each (n, 3)
    high: list[FloatArray] = field(default_factory=list)

    def add(self, low: FloatArray, high: FloatArray) -> None:
        """Note closed boxes (n, 3) or one (3,)."""
        self.low.append(low)
        self.high.append(high)

    def rooms(self) -> Rooms:
        """How far each body might have grown without a say in any answer."""
        low, high = (np.concatenate([np.empty((0, 3)), *map(np.atleast_2d, ends)]) for ends in (self.low, self.high))
        return rooms(low, high, self.scene.low, self.scene.high)


class Scene:
    """Named meshes at fixed poses of one frame. Every question goes by bounding boxes first, and these can be watched."""

    def __init__(self, surfaces: Sequence[PlacedSurface]) -> None:
        self.names = tuple(item.name for item in surfaces)
        self.items = tuple(surfaces)
        self._objects = _PlacedObjects(self.items)
        corners = [item.surface.mesh.vertices_mm @ item.X[:3, :3].T + item.X[:3, 3] for item in surfaces]
        self.low = np.array([points.min(axis=0) for points in corners]).reshape(-1, 3)  # (s, 3)
        self.high = np.array([points.max(axis=0) for points in corners]).reshape(-1, 3)
        self._watch: Watch | None = None

    @contextmanager
    def watched(self) -> Iterator[Watch]:
        """What is asked meanwhile."""
        self._watch = Watch(scene=self)
        try:
            yield self._watch
        finally:
            self._watch = None

    def __len__(self) -> int:
        return len(self.items)

    def _near(self, shape: ConvexShape, X: FloatArray, reach: float) -> list[int]:
        return self._near_box(shape.centre, shape.half, X, reach)

    def _near_box(self, centre: FloatArray, half: FloatArray, X: FloatArray, reach: float) -> list[int]:
        """Indices of meshes whose bounding boxes come within `reach` of a box placed at X."""
        centre = X[:3, :3] @ centre + X[:3, 3]
        half = np.abs(X[:3, :3]) @ half + reach
        return np.flatnonzero(self._meet(centre - half, centre + half)).tolist()

    def _meet(self, low: FloatArray, high: FloatArray) -> BoolArray:
        """Which bounding boxes meet a closed box, (s,)."""
        if self._watch is not None:
            self._watch.add(low, high)
        return np.asarray(((self.low <= high) & (self.high >= low)).all(axis=1))

    def first_hits(self, shape: ConvexShape, X: FloatArray) -> IntArray:
        """For each pose (n, 4, 4) of the solid the index in `names` of a mesh whose surface it touches, or −1, (n,)."""
        found = np.full(len(X), -1)
        if not len(self) or not len(X):
            return found
        centre = X[:, :3, :3] @ shape.centre + X[:, :3, 3]  # (n, 3)
        half = np.abs(X[:, :3, :3]) @ shape.half
        low, high = centre - half, centre + half
        if self._watch is not None:
            self._watch.add(low, high)
        near = np.ones((len(X), len(self)), dtype=bool)
        for k in range(3):  # one axis at a time: no (n, s, 3) array
            near &= self.low[:, k] <= high[:, k, None]
            near &= self.high[:, k] >= low[:, k, None]
        solid, rows = shape.placed(np.eye(4)), np.flatnonzero(near.any(axis=1))
        origins = X[rows, :3, 3] if shape.offset is None else X[rows, :3, :3] @ shape.offset + X[rows, :3, 3]
        for row, rotation, origin in zip(rows.tolist(), X[rows, :3, :3], origins, strict=True):
            solid.setTransform(fcl.Transform(rotation, origin))
            for i in np.flatnonzero(near[row]).tolist():
                if fcl.collide(solid, self._objects[i], _REQUEST, fcl.CollisionResult()):
                    found[row] = i
                    break
        return found

    def last_touch(self, solid: Shrinking, passage: Passage, start_mm: float, end_mm: float) -> tuple[float, str | None]:
        """The greatest s within [start, end] at which a solid, on its passage, touches a surface, and its name; −inf: none."""
        best, name = -np.inf, None
        low, high = passage.box(solid.centre, solid.half)
        near = self._meet(low, high)
        for i in np.flatnonzero(near).tolist():
            item = self.items[i]
            found = item.surface.blocks.last_touch_mm(solid, passage, item.X, max(best, start_mm), end_mm)
            if found > best:
                best, name = found, item.name
            if best >= end_mm:
                break
        return best, name

    def touched(self, shape: ConvexShape, X: FloatArray) -> list[PlacedSurface]:
        """All meshes whose surface the solid touches at pose X of the scene's frame."""
        near = self._near(shape, X, 0.0)
        solid = shape.placed(X)
        return [self.items[i] for i in near if fcl.collide(solid, self._objects[i], _REQUEST, fcl.CollisionResult())]

    def distance(self, shape: ConvexShape, X: FloatArray, limit: float = np.inf) -> tuple[float, str | None]:
        """Least distance of the solid to any surface and that mesh's name; 0 where they touch; `limit`, None beyond it."""
        best, name = limit, None
        for i in self._near(shape, X, limit if np.isfinite(limit) else 1e9):
            solid = shape.placed(X)
            if fcl.collide(solid, self._objects[i], _REQUEST, fcl.CollisionResult()):
                return 0.0, self.names[i]
            found = fcl.distance(solid, self._objects[i], fcl.DistanceRequest(), fcl.DistanceResult())
            if found < best:
                best, name = float(found), self.names[i]
        return best, name

    def first_surface_hit(self, surface: MeshSurface, X: FloatArray) -> str | None:
        """Name of a mesh whose surface crosses another surface at pose X of the scene's frame, or None."""
        body = fcl.CollisionObject(surface.geometry, fcl.Transform(X[:3, :3], X[:3, 3]))
        for i in self._near_box(*surface.bounds, X, 0.0):
            if fcl.collide(body, self._objects[i], _REQUEST, fcl.CollisionResult()):
                return self.names[i]
        return None

    def surface_distance(self, surface: MeshSurface, X: FloatArray, limit: float) -> float:
        """Least distance between the surface at pose X and any mesh, at most `limit`; 0 where they cross."""
        body = fcl.CollisionObject(surface.geometry, fcl.Transform(X[:3, :3], X[:3, 3]))
        centre = X[:3, :3] @ surface.bounds[0] + X[:3, 3]
        half = np.abs(X[:3, :3]) @ surface.bounds[1]
        apart = np.maximum(self.low - (centre + half), (centre - half) - self.high).max(axis=1, initial=-np.inf)  # (s,)
        best = limit
        for i in np.argsort(apart, kind="stable").tolist():
            if apart[i] > best:
                break
            if fcl.collide(body, self._objects[i], _REQUEST, fcl.CollisionResult()):
                best = 0.0
                break
            best = min(best, float(fcl.distance(body, self._objects[i], fcl.DistanceRequest(), fcl.DistanceResult())))
        self._meet(centre - half - best - _ROUNDING_MM, centre + half + best + _ROUNDING_MM)  # the others have no say
        return best

    def inside(self, point: FloatArray) -> str | None:
        """Name of a mesh that has the point (of the scene's frame) inside, by its winding number, or None."""
        near = np.flatnonzero(self._meet(point, point)).tolist()
        return next((self.items[i].name for i in near if self._within(i, point[None])[0]), None)

    def holds(self, points: FloatArray) -> BoolArray:
        """Which of the points (n, 3) some mesh has inside, (n,)."""
        if self._watch is not None:
            self._watch.add(points, points)
        found = np.zeros(len(points), dtype=bool)
        for i in range(len(self)):
            found |= self._within(i, points)
        return found

    def _within(self, i: int, points: FloatArray) -> BoolArray:
        item, near = self.items[i], np.asarray(((self.low[i] <= points) & (points <= self.high[i])).all(axis=1))
        local = (points[near] - item.X[:3, 3]) @ item.X[:3, :3]
        near[near] = np.abs(winding_numbers(item.surface.mesh, local)) > 0.5
        return near


class _PlacedObjects:
    """The FCL object of each surface, made when it is first asked for."""

    def __init__(self, items: Sequence[PlacedSurface]) -> None:
        self._items = items
        self._made: dict[int, fcl.CollisionObject] = {}

    def __getitem__(self, i: int) -> fcl.CollisionObject:
        if i not in self._made:
            item = self._items[i]
            self._made[i] = fcl.CollisionObject(item.surface.geometry, fcl.Transform(item.X[:3, :3], item.X[:3, 3]))
        return self._made[i]


def winding_number(mesh: Mesh, point: FloatArray) -> float:
    """Generalised winding number of a point (van Oosterom and Strackee 1983): 1 inside a closed mesh, 0 outside."""
    return float(winding_numbers(mesh, point[None])[0])


def winding_numbers(mesh: Mesh, points: FloatArray) -> FloatArray:
    """The same of each of n points, (n,)."""
    return np.asarray(_winding_numbers(np.ascontiguousarray(mesh.vertices_mm), mesh.faces, np.ascontiguousarray(points)))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _winding_numbers(vertices: FloatArray, faces: IntArray, points: FloatArray) -> FloatArray:
    found = np.zeros(len(points))
    for k in range(len(points)):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        for face in faces:
            i, j, m = face[0], face[1], face[2]
            ax, ay, az = vertices[i, 0] - x, vertices[i, 1] - y, vertices[i, 2] - z
            bx, by, bz = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
            cx, cy, cz = vertices[m, 0] - x, vertices[m, 1] - y, vertices[m, 2] - z
            a, b, c = (
                np.sqrt(ax * ax + ay * ay + az * az),
                np.sqrt(bx * bx + by * by + bz * bz),
                np.sqrt(cx * cx + cy * cy + cz * cz),
            )
            volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
            found[k] += np.arctan2(volume, a * b * c + ab * c + bc * a + ca * b)
    return found / (2.0 * np.pi)
