"""The motion of an assembly operation and the volumes that a hand sweeps along it, without gaps.

A step between two poses is a screw motion. A step without rotation is swept exactly by the convex hull of start and end;
a step with rotation is divided until each arc is short, and the hull of neighbouring positions is grown by the arc's sagitta.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray
from gripwright.geometry.collision import ConvexShape
from gripwright.geometry.frames import inverse
from gripwright.geometry.solids import dilated, hull_vertices, swept

_ARC_RAD = np.radians(9.0)
_STILL = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """One swept piece of a motion: from pose `X_start` the body moves by `displacement` seen from the body's own frame."""

    X_start: FloatArray  # (4, 4) displacement of the active subassembly in the product frame at the step's start
    X_move: FloatArray  # (4, 4) from the step's start to its end, in the product frame: X_end = X_move · X_start
    angle_rad: float
    axis_P: FloatArray  # (2, 3) a point and the direction of the screw axis, product frame; unused where angle is 0


def steps(motion: FloatArray) -> list[Step]:
    """The motion (k, 4, 4) as steps that can be swept; neighbouring straight steps in one direction are joined."""
    result: list[Step] = []
    for start, end in pairwise(motion):
        move = end @ inverse(start)
        angle = float(np.linalg.norm(Rotation.from_matrix(move[:3, :3]).as_rotvec()))
        if angle < 1e-7:
            straight = np.eye(4)
            straight[:3, 3] = end[:3, 3] - start[:3, 3]
            _append_straight(result, start, straight)
            continue
        parts = int(np.ceil(angle / _ARC_RAD))
        part = np.real(expm(np.real(logm(move)) / parts))
        axis = _screw_axis(move)
        pose = start
        for _ in range(parts):
            result.append(Step(X_start=pose, X_move=part, angle_rad=angle / parts, axis_P=axis))
            pose = part @ pose
    return result


def sampled(motion: FloatArray, count: int) -> list[FloatArray]:
    """About `count` poses along the motion besides its given ones, start and end included, in order."""
    moves = [end @ inverse(start) for start, end in pairwise(motion)]
    sizes = np.array([_size(move) for move in moves])
    share = np.ceil(count * sizes / max(float(sizes.sum()), _STILL)).astype(int)
    result = [motion[0]]
    for start, end, move, parts in zip(motion[:-1], motion[1:], moves, np.maximum(share, 1), strict=True):
        part = np.real(expm(np.real(logm(move)) / parts))
        pose = start
        for _ in range(parts - 1):
            pose = part @ pose
            result.append(pose)
        result.append(end)
    return result


def _size(move: FloatArray) -> float:
    """Length of a move: its translation, and its rotation as the arc at a radius of 50 mm."""
    turn = float(np.linalg.norm(Rotation.from_matrix(move[:3, :3]).as_rotvec()))
    return float(np.linalg.norm(move[:3, 3])) + 50.0 * turn


def _append_straight(result: list[Step], start: FloatArray, move: FloatArray) -> None:
    length = float(np.linalg.norm(move[:3, 3]))
    if length < _STILL:
        return
    if result and result[-1].angle_rad == 0.0:
        last = result[-1].X_move[:3, 3]
        if np.linalg.norm(np.cross(last, move[:3, 3])) < 1e-9 * length * np.linalg.norm(last) and last @ move[:3, 3] > 0:
            joined = np.eye(4)
            joined[:3, 3] = last + move[:3, 3]
            result[-1] = Step(X_start=result[-1].X_start, X_move=joined, angle_rad=0.0, axis_P=np.zeros((2, 3)))
            return
    result.append(Step(X_start=start, X_move=move, angle_rad=0.0, axis_P=np.zeros((2, 3))))


def _screw_axis(move: FloatArray) -> FloatArray:
    """Point and direction (2, 3) of the screw axis of a rigid motion with rotation: (I − R) p = t, perpendicular to the axis."""
    direction = Rotation.from_matrix(move[:3, :3]).as_rotvec()
    direction /= np.linalg.norm(direction)
    translation = move[:3, 3] - direction * (direction @ move[:3, 3])
    point = np.linalg.lstsq(np.eye(3) - move[:3, :3], translation, rcond=None)[0]
    return np.stack([point, direction])


class SweptHand:
    """The shapes that convex solids of a hand sweep along a motion, cached by the move seen from the hand's frame."""

    def __init__(self) -> None:
        self._cache: dict[tuple[bytes, ...], ConvexShape] = {}

    def still(self, vertices: FloatArray) -> ConvexShape:
        """The solid itself, in its own frame."""
        key = (vertices.tobytes(),)
        if key not in self._cache:
            self._cache[key] = ConvexShape(vertices)
        return self._cache[key]

    def shape(self, vertices_G: FloatArray, margin_mm: float, step: Step, X_PG: FloatArray) -> ConvexShape:
        """The sweep of the solid during a step, in the hand's frame at the step's start. `X_PG`: the hand at that moment."""
        move_G = inverse(X_PG) @ step.X_move @ X_PG
        arm = 0.0
        if step.angle_rad > 0.0:
            corners_P = vertices_G @ X_PG[:3, :3].T + X_PG[:3, 3]
            arm = float(np.linalg.norm(np.cross(corners_P - step.axis_P[0], step.axis_P[1]), axis=1).max())
        sagitta = np.ceil(arm * (1.0 - np.cos(step.angle_rad / 2.0)) * 1e3) / 1e3
        key = (vertices_G.tobytes(), np.round(move_G, 6).tobytes(), np.float64(margin_mm + sagitta).tobytes())
        if key not in self._cache:
            body = dilated(vertices_G, margin_mm + float(sagitta))
            if step.angle_rad == 0.0:
                moved = swept(body, np.round(move_G[:3, 3], 9))
            else:
                moved = hull_vertices(np.concatenate([body, body @ move_G[:3, :3].T + move_G[:3, 3]]))
            self._cache[key] = ConvexShape(moved)
        return self._cache[key]
