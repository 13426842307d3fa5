"""The motion of an assembly operation and the volumes that a hand sweeps along it, without gaps.

A leg between two poses is a screw motion. A leg without rotation is swept exactly by the convex hull of start and end; one with
rotation is divided until each arc is short, and the hull of neighbouring stations is grown by the arc's sagitta. Whether a
sweep is free is asked of the hull of the whole motion first, then of its halves, down to single steps.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray
from gripwright.geometry.collision import ConvexShape, Scene
from gripwright.geometry.frames import inverse
from gripwright.geometry.solids import dilated, hull_vertices, swept

_ARC_RAD = np.radians(9.0)
_STILL = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stations:
    """A motion as poses between which every arc is short: n displacements of the active subassembly, n − 1 steps."""

    poses: FloatArray  # (n, 4, 4), product frame
    arcs_rad: FloatArray  # (n - 1,) rotation of each step, 0 for a straight one
    axes_P: FloatArray  # (n - 1, 2, 3) point and direction of each step's screw axis


def stations(motion: FloatArray) -> Stations:
    """The motion (k, 4, 4) as stations; neighbouring straight legs in one direction are joined."""
    poses, arcs, axes = [motion[0]], [0.0], [np.zeros((2, 3))]
    for end in motion[1:]:
        move = end @ inverse(poses[-1])
        angle = _turn_rad(move)
        if angle < 1e-7:
            along = end[:3, 3] - poses[-1][:3, 3]
            if np.linalg.norm(along) < _STILL:
                continue
            if len(poses) > 1 and arcs[-1] == 0.0 and _same_direction(along, poses[-1][:3, 3] - poses[-2][:3, 3]):
                poses[-1] = end
                continue
            poses, arcs, axes = [*poses, end], [*arcs, 0.0], [*axes, np.zeros((2, 3))]
            continue
        parts = int(np.ceil(angle / _ARC_RAD))
        axis = _screw_axis(move)
        for pose in _divided(poses[-1], end, parts):
            poses, arcs, axes = [*poses, pose], [*arcs, angle / parts], [*axes, axis]
    return Stations(poses=np.array(poses), arcs_rad=np.array(arcs[1:]), axes_P=np.array(axes[1:]).reshape(-1, 2, 3))


def sampled(motion: FloatArray, count: int) -> list[FloatArray]:
    """About `count` poses along the motion besides its given ones, start and end included, in order."""
    sizes = np.array([_size(end @ inverse(start)) for start, end in pairwise(motion)])
    shares = np.ceil(count * sizes / max(float(sizes.sum()), _STILL)).astype(int)
    result = [motion[0]]
    for start, end, parts in zip(motion[:-1], motion[1:], np.maximum(shares, 1), strict=True):
        result += _divided(start, end, int(parts))
    return result


def _divided(start: FloatArray, end: FloatArray, parts: int) -> list[FloatArray]:
    """The ends of `parts` equal screw motions from start to end."""
    part = np.real(expm(np.real(logm(end @ inverse(start))) / parts))
    poses = [start]
    for _ in range(parts - 1):
        poses.append(part @ poses[-1])
    return [*poses[1:], end]


def _size(move: FloatArray) -> float:
    """Length of a move: its translation, and its rotation as the arc at a radius of 50 mm."""
    return float(np.linalg.norm(move[:3, 3])) + 50.0 * _turn_rad(move)


def _turn_rad(move: FloatArray) -> float:
    return float(np.linalg.norm(Rotation.from_matrix(move[:3, :3]).as_rotvec()))


def _same_direction(a: FloatArray, b: FloatArray) -> bool:
    length = np.linalg.norm(a) * np.linalg.norm(b)
    return bool(np.linalg.norm(np.cross(a, b)) < 1e-9 * length and a @ b > 0)


def _screw_axis(move: FloatArray) -> FloatArray:
    """Point and direction (2, 3) of the screw axis of a rigid motion with rotation: (I − R) p = t, perpendicular to the axis."""
    direction = Rotation.from_matrix(move[:3, :3]).as_rotvec()
    direction /= np.linalg.norm(direction)
    translation = move[:3, 3] - direction * (direction @ move[:3, 3])
    point = np.linalg.lstsq(np.eye(3) - move[:3, :3], translation, rcond=None)[0]
    return np.stack([point, direction])


class Sweeps:
    """Shapes of convex solids, still and swept, kept for the next grasp that needs the same."""

    def __init__(self, way: Stations) -> None:
        self._way = way
        self._shapes: dict[tuple[bytes, ...], ConvexShape] = {}

    def still(self, vertices: FloatArray) -> ConvexShape:
        """The solid itself, in its own frame."""
        key = (vertices.tobytes(),)
        if key not in self._shapes:
            self._shapes[key] = ConvexShape(vertices)
        return self._shapes[key]

    def first_hit(self, scene: Scene, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> str | None:
        """What the solid (frame B, which stands at D · X_PB when the subassembly is displaced by D) hits along the motion."""
        placed = self._way.poses @ X_PB  # (n, 4, 4)
        ranges = [(0, len(placed) - 1)] if len(placed) > 1 else []
        while ranges:
            start, end = ranges.pop()
            hit = scene.first_hit(self._swept(vertices, margin_mm, placed, start, end), placed[start])
            if hit is None:
                continue
            if end - start == 1:
                return hit
            middle = (start + end) // 2
            ranges += [(start, middle), (middle, end)]  # the end, where things are close, comes first
        return None

    def _swept(self, vertices: FloatArray, margin_mm: float, placed: FloatArray, start: int, end: int) -> ConvexShape:
        """Hull of the solid between two stations, in its frame at the first."""
        moves = np.round(inverse(placed[start]) @ placed[start : end + 1], 6)  # (k, 4, 4)
        grown = np.ceil((margin_mm + self._sagitta_mm(vertices, placed, start, end)) * 1e3) / 1e3
        key = (vertices.tobytes(), moves.tobytes(), np.float64(grown).tobytes())
        if key not in self._shapes:
            body = dilated(vertices, float(grown))
            if end - start == 1 and self._way.arcs_rad[start] == 0.0:
                points = swept(body, moves[-1, :3, 3])
            else:
                points = np.einsum("kij,nj->kni", moves[:, :3, :3], body) + moves[:, None, :3, 3]
                points = hull_vertices(points.reshape(-1, 3))
            self._shapes[key] = ConvexShape(points)
        return self._shapes[key]

    def _sagitta_mm(self, vertices: FloatArray, placed: FloatArray, start: int, end: int) -> float:
        """By how much an arc leaves the chord between neighbouring stations, at the most."""
        turning = start + np.flatnonzero(self._way.arcs_rad[start:end])
        if len(turning) == 0:
            return 0.0
        corners = np.einsum("kij,nj->kni", placed[turning, :3, :3], vertices) + placed[turning, None, :3, 3]
        arms = np.cross(corners - self._way.axes_P[turning, None, 0], self._way.axes_P[turning, None, 1])
        reach = np.linalg.norm(arms, axis=2).max(axis=1)  # (k,)
        return float((reach * (1.0 - np.cos(self._way.arcs_rad[turning] / 2.0))).max())
