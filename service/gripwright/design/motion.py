"""The motion of an assembly operation and the volumes that a hand sweeps along it, without gaps.

A leg between two poses is a screw motion. A leg without rotation is swept exactly by the convex hull of start and end; one with
rotation is divided until each arc is short, and the hull of neighbouring stations is grown by the arc's sagitta. Whether a
sweep is free is asked of the hull of the whole motion first, then of its halves, down to single steps.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.collision import ConvexShape, Scene
from gripwright.geometry.frames import inverse
from gripwright.geometry.solids import dilated, swept

_ARC_RAD = np.radians(9.0)
_STILL = 1e-9
_ROUNDING_MM = 1e-3  # shapes are shared between grasps whose moves differ by less


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stretch:
    """Part of a motion as poses between which every arc is short: n displacements of the active subassembly, n − 1 steps.

    Of a screw motion of several turns it holds the first turn; `drift_P` leads each of its steps to the last turn that repeats
    it. What lies between is swept with it: a hand is higher than a thread's pitch.
    """

    poses: FloatArray  # (n, 4, 4), product frame
    arcs_rad: FloatArray  # (n - 1,) rotation of each step, 0 for a straight one
    axes_P: FloatArray  # (n - 1, 2, 3) point and direction of each step's screw axis
    drift_P: FloatArray  # (n - 1, 3), no shorter for an earlier step

    @property
    def uniform(self) -> bool:
        """Whether every step repeats one and the same displacement."""
        moves = self.poses[1:] @ inverse(self.poses[:-1])  # (n - 1, 4, 4)
        return bool(np.abs(moves - moves[:1]).max(initial=0.0) < 1e-6)


def stretches(motion: FloatArray) -> list[Stretch]:
    """The motion (k, 4, 4) as stretches; neighbouring straight legs in one direction are joined, turns of a thread too."""
    result: list[Stretch] = []
    for leg in _legs(motion):
        move = leg[-1] @ inverse(leg[0]) if len(leg) == 2 else leg[1] @ inverse(leg[0])
        angle = _turn_rad(move)
        if angle < 1e-7:
            result.append(_stretch([leg[0], leg[-1]], 0.0, np.zeros((2, 3)), np.zeros((1, 3))))
            continue
        axis, parts = _screw_axis(move), int(np.ceil(angle / _ARC_RAD - 1e-6))
        period = 2.0 * np.pi / angle  # in legs
        kept = leg[: int(np.ceil(period - 1e-6)) + 1]
        poses = [kept[0]]
        for start, end in pairwise(kept):
            poses += _divided(start, end, parts)
        begins = np.arange(len(poses) - 1) / parts  # of each step, in legs
        repeats = np.maximum(np.ceil((len(leg) - 1 - begins) / period - 1e-6) - 1.0, 0.0)
        pitch_P = (axis[1] @ move[:3, 3]) * period * axis[1]
        result.append(_stretch(poses, angle / parts, axis, repeats[:, None] * pitch_P))
    return result


def _stretch(poses: list[FloatArray], arc_rad: float, axis: FloatArray, drift_P: FloatArray) -> Stretch:
    count = len(poses) - 1
    return Stretch(poses=np.array(poses), arcs_rad=np.full(count, arc_rad), axes_P=np.tile(axis, (count, 1, 1)), drift_P=drift_P)


def _legs(motion: FloatArray) -> list[list[FloatArray]]:
    """Neighbouring poses that differ by one and the same move, together; poses that do not differ, left out."""
    legs: list[list[FloatArray]] = []
    for start, end in pairwise(motion):
        move = end @ inverse(start)
        turns = _turn_rad(move) >= 1e-7
        if not turns and np.linalg.norm(move[:3, 3]) < _STILL:
            continue
        before = legs[-1][-1] @ inverse(legs[-1][-2]) if legs else None
        if before is None or not (_repeats(before, move) if turns else _goes_on(before, move)):
            legs.append([start, end])
        else:
            legs[-1].append(end)
    return legs


def _repeats(before: FloatArray, move: FloatArray) -> bool:
    return bool(np.abs(before - move).max() < 1e-5)


def _goes_on(before: FloatArray, move: FloatArray) -> bool:
    a, b = before[:3, 3], move[:3, 3]
    length = np.linalg.norm(a) * np.linalg.norm(b)
    return bool(_turn_rad(before) < 1e-7 and np.linalg.norm(np.cross(a, b)) < 1e-9 * length and a @ b > 0)


def sampled(motion: FloatArray, count: int) -> list[FloatArray]:
    """About `count` poses along the motion besides its given ones, start and end included, in order."""
    sizes = np.array([path_mm(end @ inverse(start)) for start, end in pairwise(motion)])
    shares = np.ceil(count * sizes / max(float(sizes.sum()), _STILL)).astype(int)
    result = [motion[0]]
    for start, end, parts in zip(motion[:-1], motion[1:], np.maximum(shares, 1), strict=True):
        result += _divided(start, end, int(parts))
    return result


def pose_at(motion: FloatArray, share: float) -> FloatArray:
    """The pose of a motion (k, 4, 4) at about a share of its path, to a hundredth."""
    poses = sampled(motion, 100)
    lengths = np.array([path_mm(end @ inverse(start)) for start, end in pairwise(poses)])
    shares = np.append(0.0, np.cumsum(lengths)) / max(float(lengths.sum()), _STILL)
    return poses[int(np.abs(shares - share).argmin())]


def _divided(start: FloatArray, end: FloatArray, parts: int) -> list[FloatArray]:
    """The ends of `parts` equal screw motions from start to end."""
    move = end @ inverse(start)
    shares = np.arange(1, parts) / parts
    turn = _rotation(move)
    moves = np.tile(np.eye(4), (parts - 1, 1, 1))
    moves[:, :3, 3] = shares[:, None] * move[:3, 3]
    if turn.magnitude() > 1e-7 and parts > 1:
        point, direction = _screw_axis(move)
        moves[:, :3, :3] = Rotation.from_rotvec(shares[:, None] * turn.as_rotvec()).as_matrix()
        rise = shares[:, None] * (direction @ move[:3, 3]) * direction
        moves[:, :3, 3] = point - moves[:, :3, :3] @ point + rise
    return [*(moves @ start), end]


def path_mm(move: FloatArray) -> float:
    """Length of a move: its translation, and its rotation as the arc at a radius of 50 mm."""
    return float(np.linalg.norm(move[:3, 3])) + 50.0 * _turn_rad(move)


def _rotation(move: FloatArray) -> Rotation:
    return Rotation.from_matrix(move[:3, :3])


def _turn_rad(move: FloatArray) -> float:
    return float(_rotation(move).magnitude())


def _screw_axis(move: FloatArray) -> FloatArray:
    """Point and direction (2, 3) of the screw axis of a rigid motion with rotation: (I − R) p = t, perpendicular to the axis."""
    direction = _rotation(move).as_rotvec()
    direction /= np.linalg.norm(direction)
    translation = move[:3, 3] - direction * (direction @ move[:3, 3])
    point = np.linalg.lstsq(np.eye(3) - move[:3, :3], translation, rcond=None)[0]
    return np.stack([point, direction])


class Sweeps:
    """Shapes of convex solids, still and swept, kept for the next grasp that needs the same."""

    def __init__(self, motion: FloatArray) -> None:
        self._way = stretches(motion)
        self._uniform = [stretch.uniform for stretch in self._way]
        self.turning = any(stretch.arcs_rad.any() for stretch in self._way)
        self._shapes: dict[tuple[bytes, ...], ConvexShape] = {}

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

    def _swept(self, k: int, vertices: FloatArray, margin_mm: float, placed: FloatArray, start: int, end: int) -> ConvexShape:
        """Hull of the solid between two stations of a stretch, in its frame at the first."""
        stops = placed[start : start + 2] if self._uniform[k] else placed[start : end + 1]  # one step tells the others
        moves = np.round(inverse(placed[start]) @ stops[1:], 5)
        drift = np.round(placed[start, :3, :3].T @ self._way[k].drift_P[start], 5)
        key = (vertices.tobytes(), moves.tobytes(), drift.tobytes(), np.array([margin_mm, end - start]).tobytes())
        if key not in self._shapes:
            self._shapes[key] = ConvexShape(_hull(self._way[k], vertices, margin_mm, placed[start : end + 1], start))
        return self._shapes[key]


def step_solid(stretch: Stretch, number: int, vertices: FloatArray, margin_mm: float, X_PB: FloatArray) -> FloatArray:
    """Points whose hull holds what the solid (frame B) sweeps in one step of a stretch, in its frame at the step's start."""
    return _hull(stretch, vertices, margin_mm, stretch.poses[number : number + 2] @ X_PB, number)


def _hull(stretch: Stretch, vertices: FloatArray, margin_mm: float, placed: FloatArray, start: int) -> FloatArray:
    """Points whose hull holds the solid's sweep over the stations `placed` (k, 4, 4), the first of them number `start`."""
    moves = inverse(placed[0]) @ placed
    turning = stretch.arcs_rad[start] > 0.0
    if len(placed) == 2 and not turning:
        return swept(dilated(vertices, margin_mm + _ROUNDING_MM), np.round(moves[-1, :3, 3], 9))
    grown = margin_mm + _ROUNDING_MM + (_sagitta_mm(stretch, vertices, placed, start) if turning else np.zeros(3))
    points = np.einsum("kij,nj->kni", moves[:, :3, :3], dilated(vertices, grown)) + moves[:, None, :3, 3]
    points = points.reshape(-1, 3)
    if stretch.drift_P[start].any():
        points = np.concatenate([points, points + placed[0, :3, :3].T @ stretch.drift_P[start]])
    return np.asarray(points)


def _sagitta_mm(stretch: Stretch, vertices: FloatArray, placed: FloatArray, start: int) -> FloatArray:
    """By how much the arc of a step leaves its chord along each axis of the solid's frame, at the most, (3,).

    It does so across the screw axis alone. All steps of a turning stretch turn about one axis.
    """
    corners = vertices @ placed[0, :3, :3].T + placed[0, :3, 3]
    point, direction = stretch.axes_P[start]
    arm = np.linalg.norm(np.cross(corners - point, direction), axis=1).max()
    across = np.sqrt(np.maximum(1.0 - (placed[0, :3, :3].T @ direction) ** 2, 0.0))
    return np.asarray(across * arm * (1.0 - np.cos(stretch.arcs_rad[start] / 2.0)))
