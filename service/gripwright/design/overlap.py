"""Whether a motion overlaps by itself: the active subassembly against the passive one. Real files do, by hundredths to tenths."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.design.motion import sampled
from gripwright.design.scenes import Body
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.measures import face_centres_mm
from gripwright.geometry.rays import RayScene

_POSES = 16  # along the motion, besides its given ones
_POINTS = 3000  # of a component's surface, looked at in one pose
_DIRECTIONS = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], dtype=float)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Overlap:
    """The deepest place found: `depth_mm` is measured along 26 directions, an upper bound of the true depth there."""

    active: str
    passive: str
    depth_mm: float
    place_P: FloatArray  # (3,)
    share: float  # of the motion, 0 start, 1 end

    def __str__(self) -> str:
        place = ", ".join(f"{value:.1f}" for value in self.place_P)
        return (
            f"{self.active} overlaps {self.passive} by {self.depth_mm:.2f} mm at ({place}), "
            f"{100 * self.share:.0f} % along the motion"
        )


def deepest_overlap(motion: FloatArray, active: Sequence[Body], passive: Sequence[Body]) -> Overlap | None:
    """The deepest overlap over sampled poses (k, 4, 4) of the motion, or None."""
    poses = sampled(motion, _POSES)
    worst: Overlap | None = None
    for moved in active:
        points_C = _surface_points(moved.solid)
        for fixed in swept_over(motion, [moved], passive):
            inside = _Inside(fixed.solid)
            X_QP = inverse(fixed.component.X_PC)
            for number, pose in enumerate(poses):
                points_P = transform(pose @ moved.component.X_PC, points_C)
                depth, index = inside.deepest(transform(X_QP, points_P))
                if depth > (0.0 if worst is None else worst.depth_mm):
                    worst = Overlap(
                        active=moved.component.id,
                        passive=fixed.component.id,
                        depth_mm=depth,
                        place_P=points_P[index],
                        share=number / max(len(poses) - 1, 1),
                    )
    return worst


def swept_over(motion: FloatArray, active: Sequence[Body], passive: Sequence[Body]) -> list[Body]:
    """The passive components that the active ones come near enough to overlap: the others have no say in the deepest overlap."""
    poses = np.array(sampled(motion, _POSES))
    near = []
    swept = [_extents(poses @ moved.component.X_PC, moved.solid) for moved in active]
    for fixed in passive:
        (low,), (high,) = _extents(fixed.component.X_PC[None], fixed.solid)
        if any(((a < high) & (b > low)).all(axis=1).any() for a, b in swept):
            near.append(fixed)
    return near


def _extents(X: FloatArray, mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corners (k, 3) of the mesh's bounding boxes at poses (k, 4, 4)."""
    points = mesh.vertices_mm @ np.swapaxes(X[:, :3, :3], 1, 2) + X[:, None, :3, 3]  # (k, n, 3)
    return points.min(axis=1), points.max(axis=1)


def _surface_points(mesh: Mesh) -> FloatArray:
    """Corners and centres of faces, thinned evenly to `_POINTS`."""
    points = np.concatenate([mesh.vertices_mm, face_centres_mm(mesh)])
    return points[:: max(1, len(points) // _POINTS)]


class _Inside:
    """How deep points lie inside a mesh, by rays."""

    def __init__(self, mesh: Mesh) -> None:
        self._low, self._high = mesh.vertices_mm.min(axis=0), mesh.vertices_mm.max(axis=0)
        self._mesh = mesh
        self._scene: RayScene | None = None

    def deepest(self, points: FloatArray) -> tuple[float, int]:
        """Depth (0: none is inside) and index of the deepest point (n, 3)."""
        near = np.flatnonzero(((points > self._low) & (points < self._high)).all(axis=1))
        if len(near) == 0:
            return 0.0, 0
        if self._scene is None:
            self._scene = RayScene(self._mesh.vertices_mm, self._mesh.faces)
        origins = np.repeat(self._scene.centred(points[near]), len(_DIRECTIONS), axis=0)
        directions = np.ascontiguousarray(np.tile(_DIRECTIONS, (len(near), 1)), dtype=np.float32)
        distance, face, normal = self._scene.first_hits(origins, directions)
        leaving = (face >= 0) & (np.einsum("ij,ij->i", normal, directions) > 0)  # the first hit is met from inside
        leaving = leaving.reshape(len(near), -1)
        depth = np.where(leaving.all(axis=1), distance.reshape(len(near), -1).min(axis=1), 0.0)
        best = int(depth.argmax())
        return float(depth[best]), int(near[best])
