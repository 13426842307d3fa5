"""The volumes that convex solids sweep along a motion, without gaps.

A stretch without rotation is swept exactly by the convex hull of start and end; of one with rotation the hull of neighbouring
stations is grown by the arc's sagitta. Whether a sweep is free is asked of the hull of the whole stretch first, then of its
halves, down to single steps.
"""

from collections.abc import Callable

import numpy as np

from gripwright.design.motion import Stretch, stretches
from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.collision import ConvexShape, Scene
from gripwright.geometry.frames import inverse
from gripwright.geometry.polytope import Faces, Polytope
from gripwright.geometry.solids import dilated, swept
from gripwright.geometry.withdrawal import Shrinking

_ROUNDING_MM = 1e-3  # shapes are shared between grasps whose moves differ by less
_STEADY = 1e-9


class Sweeps:
    """Shapes of convex solids, still and swept, kept for the next grasp that needs the same."""

    def __init__(self, motion: FloatArray) -> None:
        self._way = stretches(motion)
        self._uniform = [stretch.uniform for stretch in self._way]
        self.turning = any(stretch.arcs_rad.any() for stretch in self._way)
        self._shapes: dict[tuple[bytes, ...], ConvexShape] = {}
        self._polytopes: dict[tuple[bytes, float], Polytope] = {}
        self._hulls: dict[tuple[bytes, ...], Faces] = {}

    def keeps(self, direction_P: FloatArray) -> bool:
        """Whether a direction (3,) that moves along looks the same way all the time."""
        turned = [stretch.poses[:, :3, :3] @ direction_P for stretch in self._way]
        start = self._way[0].poses[0, :3, :3] @ direction_P if self._way else direction_P
        return all(float(np.abs(looks - start).max()) < _STEADY for looks in turned)

    def polytope(self, vertices: FloatArray, margin_mm: float) -> Polytope:
        """The solid's faces and edges with the margin around it, in its own frame."""
        key = (vertices.tobytes(), margin_mm)
        if key not in self._polytopes:
            self._polytopes[key] = Polytope(dilated(vertices, margin_mm))
        return self._polytopes[key]

    def last_touch(
        self,
        scene: Scene,
        vertices: FloatArray,
        margin_mm: float,
        X_PB: FloatArray,
        shrinking: Callable[[Faces], Shrinking],
        span_mm: tuple[float, float],
    ) -> tuple[float, str | None]:
        """The greatest s in a span at which what a solid (as in `first_hit`) sweeps along the motion touches the scene, and what.

        Of a solid that shrinks in a direction which the motion `keeps`: its sweep then shrinks as it does. −inf: nothing.
        """
        best, name, (start_mm, end_mm) = -np.inf, None, span_mm
        for k in range(len(self._way) - 1, -1, -1):
            placed = self._way[k].poses @ X_PB  # (n, 4, 4)
            ranges = [(0, len(placed) - 1)]
            while ranges:
                start, end = ranges.pop()
                solid = shrinking(self._swept_faces(k, vertices, margin_mm, placed, start, end))
                found, body = scene.last_touch(solid, placed[start], max(best, start_mm), end_mm)
                if found <= best:
                    continue
                if end - start == 1:
                    best, name = found, body
                else:
                    middle = (start + end) // 2
                    ranges += [(start, middle), (middle, end)]
        return best, name

    def still(self, vertices: FloatArray) -> ConvexShape:
        """The solid itself, in its own frame."""
        key = (vertices.tobytes(),)
        if key not in self._shapes:
            self._shapes[key] = ConvexShape(vertices)
        return self._shapes[key]

    def first_hit(self, scene: Scene, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> str | None:
        """What the solid (frame B, which stands at D · X_PB when the subassembly is displaced by D) hits along the motion."""
        for k in range(len(self._way) - 1, -1, -1):  # the end, where things are close, comes first
            hit = self._hit_on(k, scene, vertices, margin_mm, X_PB)
            if hit is not None:
                return hit
        return None

    def first_hits(self, scene: Scene, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> IntArray:
        """As `first_hit` for many solids alike at poses (n, 4, 4): indices in the scene's names, −1 where none is hit, (n,)."""
        found = np.full(len(X_PB), -1)
        for k in range(len(self._way) - 1, -1, -1):
            left = np.flatnonzero(found < 0)
            if self._uniform[k] and len(self._way[k].poses) == 2:
                found[left] = self._hits_on_step(k, scene, vertices, margin_mm, X_PB[left])
                continue
            for row in left.tolist():
                hit = self._hit_on(k, scene, vertices, margin_mm, X_PB[row])
                found[row] = -1 if hit is None else scene.names.index(hit)
        return found

    def _hits_on_step(self, k: int, scene: Scene, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> IntArray:
        """Of a stretch of one step: poses from which the step is the same in the solid's frame share a sweep."""
        placed = self._way[k].poses[:, None] @ X_PB  # (2, n, 4, 4)
        if len(X_PB) == 1:
            return scene.first_hits(self._swept(k, vertices, margin_mm, placed[:, 0], 0, 1), placed[0])
        moves = np.round(inverse(placed[0]) @ placed[1], 5).reshape(-1, 16)
        found = np.full(len(X_PB), -1)
        _, group = np.unique(moves, axis=0, return_inverse=True)
        group = group.reshape(-1)
        for number in range(int(group.max(initial=-1)) + 1):
            rows = np.flatnonzero(group == number)
            shape = self._swept(k, vertices, margin_mm, placed[:, rows[0]], 0, 1)
            found[rows] = scene.first_hits(shape, placed[0, rows])
        return found

    def _hit_on(self, k: int, scene: Scene, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> str | None:
        placed = self._way[k].poses @ X_PB  # (n, 4, 4)
        ranges = [(0, len(placed) - 1)]
        while ranges:
            start, end = ranges.pop()
            hit = scene.first_hit(self._swept(k, vertices, margin_mm, placed, start, end), placed[start])
            if hit is None:
                continue
            if end - start == 1:
                return hit
            middle = (start + end) // 2
            ranges += [(start, middle), (middle, end)]
        return None

    def _swept_faces(self, k: int, vertices: FloatArray, margin_mm: float, placed: FloatArray, start: int, end: int) -> Faces:
        """As `_swept`, by its faces."""
        if len(placed) == 2 and not self._way[k].arcs_rad.any():
            move = inverse(placed[0]) @ placed[1]
            return self.polytope(vertices, margin_mm + _ROUNDING_MM).swept(np.round(move[:3, 3], 9))
        key = self._swept_key(k, vertices, margin_mm, placed, start, end)
        if key not in self._hulls:
            self._hulls[key] = Polytope(_hull(self._way[k], vertices, margin_mm, placed[start : end + 1], start)).faces
        return self._hulls[key]

    def _swept(self, k: int, vertices: FloatArray, margin_mm: float, placed: FloatArray, start: int, end: int) -> ConvexShape:
        """Hull of the solid between two stations of a stretch, in its frame at the first."""
        key = self._swept_key(k, vertices, margin_mm, placed, start, end)
        if key not in self._shapes:
            self._shapes[key] = ConvexShape(_hull(self._way[k], vertices, margin_mm, placed[start : end + 1], start))
        return self._shapes[key]

    def _swept_key(
        self, k: int, vertices: FloatArray, margin_mm: float, placed: FloatArray, start: int, end: int
    ) -> tuple[bytes, ...]:
        """What a sweep between two stations is made of, to the rounding of shapes."""
        stops = placed[start : start + 2] if self._uniform[k] else placed[start : end + 1]  # one step tells the others
        moves = np.round(inverse(placed[start]) @ stops[1:], 5)
        drift = np.round(placed[start, :3, :3].T @ self._way[k].drift_P, 5)
        return vertices.tobytes(), moves.tobytes(), drift.tobytes(), np.array([margin_mm, end - start]).tobytes()


def step_solid(stretch: Stretch, number: int, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> FloatArray:
    """Points whose hull holds what the solid (frame B) sweeps in one step of a stretch, in its frame at the step's start."""
    return _hull(stretch, vertices, margin_mm, stretch.poses[number : number + 2] @ X_PB, number)


def _hull(stretch: Stretch, vertices: FloatArray, margin_mm: float, placed: FloatArray, start: int) -> FloatArray:
    """Points whose hull holds the solid's sweep over the stations `placed` (k, 4, 4), the first of them number `start`."""
    moves = inverse(placed[0]) @ placed
    turning = stretch.arcs_rad[start] > 0.0
    if len(placed) == 2 and not turning:
        return swept(dilated(vertices, margin_mm + _ROUNDING_MM), np.round(moves[-1, :3, 3], 9))
    grown = margin_mm + _ROUNDING_MM + (_sagitta_mm(stretch, vertices, placed, start) if turning else 0.0)
    points = np.einsum("kij,nj->kni", moves[:, :3, :3], dilated(vertices, grown)) + moves[:, None, :3, 3]
    points = points.reshape(-1, 3)
    if stretch.drift_P.any():
        points = np.concatenate([points, points + placed[0, :3, :3].T @ stretch.drift_P])
    return np.asarray(points)


def _sagitta_mm(stretch: Stretch, vertices: FloatArray, placed: FloatArray, start: int) -> float:
    """By how much the arc of a step leaves its chord, at the most; all steps of a turning stretch turn about one axis."""
    corners = vertices @ placed[0, :3, :3].T + placed[0, :3, 3]
    point, direction = stretch.axes_P[start]
    arm = np.linalg.norm(np.cross(corners - point, direction), axis=1).max()
    return float(arm * (1.0 - np.cos(stretch.arcs_rad[start] / 2.0)))
