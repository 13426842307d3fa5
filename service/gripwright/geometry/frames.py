"""Rigid poses as 4×4 homogeneous matrices. `X_AB` is the pose of frame B seen from frame A: p_A = X_AB · p_B."""

import numpy as np

from gripwright.domain.shape import FloatArray


def is_rigid(X: FloatArray, tolerance: float = 1e-6) -> bool:
    """Whether X is a right-handed rigid pose: finite, last row 0 0 0 1, rotation orthonormal with determinant +1."""
    if X.shape != (4, 4) or not np.isfinite(X).all() or not np.allclose(X[3], [0, 0, 0, 1], atol=tolerance):
        return False
    R = X[:3, :3]
    return bool(np.allclose(R @ R.T, np.eye(3), atol=tolerance) and np.linalg.det(R) > 0)


def inverse(X: FloatArray) -> FloatArray:
    """Inverse of a rigid pose; (…, 4, 4) allowed."""
    R = np.swapaxes(X[..., :3, :3], -1, -2)
    result = np.zeros_like(X)
    result[..., :3, :3] = R
    result[..., :3, 3] = -np.einsum("...ij,...j->...i", R, X[..., :3, 3])
    result[..., 3, 3] = 1.0
    return result


def transform(X_AB: FloatArray, points_B: FloatArray) -> FloatArray:
    """Points (…, 3) seen from A."""
    return np.asarray(points_B @ X_AB[:3, :3].T + X_AB[:3, 3])


def pose(x: FloatArray, y: FloatArray, z: FloatArray, origin: FloatArray) -> FloatArray:
    """The pose whose axes are the unit vectors x, y, z and whose origin is given, all seen from the outer frame.

    Of arrays (…, 3), which broadcast, the poses (…, 4, 4).
    """
    columns = np.broadcast_arrays(x, y, z, origin)
    X = np.zeros((*columns[0].shape[:-1], 4, 4))
    X[..., :3, :] = np.stack(columns, axis=-1)
    X[..., 3, 3] = 1.0
    return X


def any_perpendicular(direction: FloatArray) -> FloatArray:
    """A unit vector perpendicular to a unit vector, the same each time."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    perpendicular = np.cross(direction, helper)
    return np.asarray(perpendicular / np.linalg.norm(perpendicular))


def pose_along(axis: FloatArray, origin: FloatArray) -> FloatArray:
    """A pose whose z is the unit vector `axis`, the same each time."""
    x = any_perpendicular(axis)
    return pose(x, np.cross(axis, x), axis, origin)


def rotation_z(angle_rad: float) -> FloatArray:
    """Rz(angle) as a pose."""
    X = np.eye(4)
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    X[:2, :2] = [[c, -s], [s, c]]
    return X


def moved(at: FloatArray) -> FloatArray:
    """Poses (n, 4, 4) seen from where they were, moved as `at` (n, 4) says: turned about x and z (rad), shifted along y and z."""
    a, b = at[:, 0], at[:, 1]
    zero = np.zeros(len(at))
    rows = [
        [np.cos(b), -np.sin(b), zero, zero],
        [np.cos(a) * np.sin(b), np.cos(a) * np.cos(b), -np.sin(a), at[:, 2]],
        [np.sin(a) * np.sin(b), np.sin(a) * np.cos(b), np.cos(a), at[:, 3]],
        [zero, zero, zero, zero + 1.0],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
