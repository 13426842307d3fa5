"""The volumes that convex solids sweep along a motion, without gaps.

A stretch without rotation is swept exactly by the convex hull of start and end. One with rotation is asked about by arcs, which
are halved where a finer one may tell of less, down to where an arc and its chord are one.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from gripwright.design.motion import Stretch, divided, stretches
from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.collision import ConvexShape, Scene
from gripwright.geometry.frames import inverse
from gripwright.geometry.polytope import Faces, Polytope
from gripwright.geometry.solids import dilated, swept
from gripwright.geometry.withdrawal import Passage, Shrinking, standing, unchanging

_ROUNDING_MM = 1e-3  # shapes are shared between grasps whose moves differ by less
_COARSE_ARC_RAD = np.radians(45.0)
_FINE_ARC_RAD = np.radians(0.25)  # leaves its chord by 0.001 mm at a radius of 400 mm


class Sweeps:
    """Shapes of convex solids, still and swept, kept for the next grasp that needs the same.

    A solid is told by its vertices in a frame B, which stands at D · X_PB when the active subassembly is displaced by D.
    """

    def __init__(self, motion: FloatArray) -> None:
        self._way = stretches(motion)[::-1]  # the end, where things are close, comes first
        self.turning = any(stretch.arcs_rad.any() for stretch in self._way)
        self._shapes: dict[tuple[bytes, ...], ConvexShape] = {}
        self._polytopes: dict[tuple[bytes, float], Polytope] = {}

    def still(self, vertices: FloatArray) -> ConvexShape:
        """The solid itself, in its own frame."""
        key = (vertices.tobytes(),)
        if key not in self._shapes:
            self._shapes[key] = ConvexShape(vertices)
        return self._shapes[key]

    def polytope(self, vertices: FloatArray, margin_mm: float) -> Polytope:
        """The solid's faces and edges with the margin around it, in its own frame."""
        key = (vertices.tobytes(), margin_mm)
        if key not in self._polytopes:
            self._polytopes[key] = Polytope(dilated(vertices, margin_mm))
        return self._polytopes[key]

    def first_hits(self, scene: Scene, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> IntArray:
        """What solids alike at poses (n, 4, 4) hit along the motion: indices in the scene's names, −1 for nothing, (n,)."""
        found = np.full(len(X_PB), -1)
        for stretch in self._way:
            left = np.flatnonzero(found < 0)
            if not stretch.arcs_rad.any():
                found[left] = self._hits_on_line(stretch, scene, vertices, margin_mm, X_PB[left])
                continue
            solid = self.polytope(vertices, margin_mm)
            for row in left.tolist():
                _, hit = _last_on_arcs(stretch, scene, solid, X_PB[row], unchanging, (0.0, 0.0))
                found[row] = -1 if hit is None else scene.names.index(hit)
        return found

    def last_touch(
        self,
        scene: Scene,
        solid: Polytope,
        X_PB: FloatArray,
        shrinking: Callable[[Faces], Shrinking],
        span_mm: tuple[float, float],
    ) -> tuple[float, str | None]:
        """The greatest s in a span at which a solid that shrinks touches the scene along the motion, and what; −inf: nothing."""
        best, name, (start_mm, end_mm) = -np.inf, None, span_mm
        for stretch in self._way:
            span_mm = (max(best, start_mm), end_mm)
            if stretch.arcs_rad.any():
                found = _last_on_arcs(stretch, scene, solid, X_PB, shrinking, span_mm)
            else:
                start, end = stretch.poses @ X_PB
                move_B = start[:3, :3].T @ (end - start)[:3, 3]
                found = scene.last_touch(shrinking(solid.swept(move_B)), standing(start), *span_mm)
            best, name = found if found[0] > best else (best, name)
        return best, name

    def _hits_on_line(self, stretch: Stretch, scene: Scene, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> IntArray:
        """Poses from which the stretch is the same in the solid's frame share a sweep."""
        start, end = stretch.poses[:, None] @ X_PB  # (n, 4, 4)
        moves = np.round(np.einsum("nji,nj->ni", start[:, :3, :3], (end - start)[:, :3, 3]), 5)  # (n, 3)
        found = np.full(len(X_PB), -1)
        distinct, group = np.unique(moves, axis=0, return_inverse=True)
        group = group.reshape(-1)
        for number, move in enumerate(distinct):
            rows = np.flatnonzero(group == number)
            found[rows] = scene.first_hits(self._swept(vertices, margin_mm, move), start[rows])
        return found

    def _swept(self, vertices: FloatArray, margin_mm: float, move: FloatArray) -> ConvexShape:
        key = (vertices.tobytes(), move.tobytes(), np.array(margin_mm).tobytes())
        if key not in self._shapes:
            self._shapes[key] = ConvexShape(swept(dilated(vertices, margin_mm + _ROUNDING_MM), move))
        return self._shapes[key]


def _last_on_arcs(
    stretch: Stretch,
    scene: Scene,
    solid: Polytope,
    X_PB: FloatArray,
    shrinking: Callable[[Faces], Shrinking],
    span_mm: tuple[float, float],
) -> tuple[float, str | None]:
    """As `Sweeps.last_touch` on a stretch that turns."""
    best, name, (start_mm, end_mm) = -np.inf, None, span_mm
    placed = stretch.poses @ X_PB  # (n, 4, 4)
    arcs = list(_coarse_arcs(stretch, placed, solid, shrinking))
    while arcs:
        shape, start, end, arc_rad = arcs.pop()
        passage = Passage(places=np.stack([start, end]), axis=stretch.axes_P[0], arc_rad=arc_rad)
        found, body = scene.last_touch(shape, passage, max(best, start_mm), end_mm)
        if found <= best:
            continue
        if arc_rad > _FINE_ARC_RAD:
            middle = divided(start, end, 2)[0]
            arcs += [(shape, start, middle, arc_rad / 2.0), (shape, middle, end, arc_rad / 2.0)]
            continue
        best, name = found, body
        if best >= end_mm:
            break
    return best, name


def _coarse_arcs(
    stretch: Stretch, placed: FloatArray, solid: Polytope, shrinking: Callable[[Faces], Shrinking]
) -> Iterator[tuple[Shrinking, FloatArray, FloatArray, float]]:
    """Neighbouring steps that are drawn out alike: what passes, its places at either end (4, 4), and the arc between."""
    arc_rad = float(stretch.arcs_rad[0])
    together = max(1, int(_COARSE_ARC_RAD / arc_rad))
    changes = np.flatnonzero(np.abs(np.diff(stretch.drift_P, axis=0)).max(axis=1, initial=0.0) > 0.0) + 1
    for first, last in pairwise([0, *changes.tolist(), len(placed) - 1]):
        shape = shrinking(solid.swept(placed[first, :3, :3].T @ stretch.drift_P[first]))
        for a, b in pairwise([*range(first, last, together), last]):
            yield shape, placed[a], placed[b], arc_rad * (b - a)


def step_solid(stretch: Stretch, number: int, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> FloatArray:
    """Points whose hull holds what the solid (frame B) sweeps in one step of a stretch, in its frame at the step's start."""
    placed = stretch.poses[number : number + 2] @ X_PB
    move = inverse(placed[0]) @ placed[1]
    if stretch.arcs_rad[number] == 0.0:
        return swept(dilated(vertices, margin_mm + _ROUNDING_MM), np.round(move[:3, 3], 9))
    grown = dilated(vertices, margin_mm + _ROUNDING_MM + _sagitta_mm(stretch, vertices, placed[0], number))
    points = np.concatenate([grown, grown @ move[:3, :3].T + move[:3, 3]])
    if stretch.drift_P[number].any():
        points = np.concatenate([points, points + placed[0, :3, :3].T @ stretch.drift_P[number]])
    return np.asarray(points)


def _sagitta_mm(stretch: Stretch, vertices: FloatArray, X_PB: FloatArray, number: int) -> FloatArray:
    """By how much the arc of a step leaves its chord along each axis of the solid's frame, at the most, (3,).

    It does so across the screw axis alone.
    """
    corners = vertices @ X_PB[:3, :3].T + X_PB[:3, 3]
    point, direction = stretch.axes_P[number]
    arm = np.linalg.norm(np.cross(corners - point, direction), axis=1).max()
    across = np.sqrt(np.maximum(1.0 - (X_PB[:3, :3].T @ direction) ** 2, 0.0))
    return np.asarray(across * arm * (1.0 - np.cos(stretch.arcs_rad[number] / 2.0)))
