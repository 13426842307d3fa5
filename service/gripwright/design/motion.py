"""The motion of an assembly operation, in stretches along which every arc is short.

A leg between two poses is a screw motion; neighbouring legs that repeat one move, or go on straight, are one stretch.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import inverse

_ARC_RAD = np.radians(9.0)
_STILL = 1e-9


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
            poses += divided(start, end, parts)
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
        result += divided(start, end, int(parts))
    return result


def pose_at(motion: FloatArray, share: float) -> FloatArray:
    """The pose of a motion (k, 4, 4) at about a share of its path, to a hundredth."""
    poses = sampled(motion, 100)
    lengths = np.array([path_mm(end @ inverse(start)) for start, end in pairwise(poses)])
    shares = np.append(0.0, np.cumsum(lengths)) / max(float(lengths.sum()), _STILL)
    return poses[int(np.abs(shares - share).argmin())]


def divided(start: FloatArray, end: FloatArray, parts: int) -> list[FloatArray]:
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
