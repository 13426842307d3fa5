"""Least squares and consensus (RANSAC) for planes and cylinders. Lengths in mm; every result scales with its input."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray

_ITERATIONS = 30
_CONVERGED = 1e-10  # relative change of the sum of squares
_SINGULAR = 1e14  # condition number


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlaneFit:
    """The plane {p : normal · p = offset} of least orthogonal distances."""

    normal: FloatArray  # (3,) unit
    offset_mm: float
    rms_mm: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CylinderFit:
    """An infinite cylinder, `point_mm` on its axis nearest to the centroid of the points, with standard errors.

    The errors are those of independent noise of equal size on every point: σ² (JᵀJ)⁻¹ with σ from the residuals.
    """

    point_mm: FloatArray  # (3,)
    axis: FloatArray  # (3,) unit
    radius_mm: float
    rms_mm: float
    radius_sigma_mm: float
    axis_sigma_rad: float

    def distances_mm(self, points_mm: FloatArray) -> FloatArray:
        """Signed distance of points (n, 3) from the surface, positive outside, (n,)."""
        return np.asarray(np.linalg.norm(self.radial_mm(points_mm), axis=1) - self.radius_mm)

    def radial_mm(self, points_mm: FloatArray) -> FloatArray:
        """Vectors from the axis to points (n, 3), perpendicular to the axis, (n, 3)."""
        v = points_mm - self.point_mm
        return np.asarray(v - np.outer(v @ self.axis, self.axis))


def fit_plane(points_mm: FloatArray) -> PlaneFit:
    """The plane through points (n >= 3, 3)."""
    centroid = points_mm.mean(axis=0)
    _, singular, directions = np.linalg.svd(points_mm - centroid, full_matrices=False)
    normal = directions[-1]
    return PlaneFit(normal=normal, offset_mm=float(normal @ centroid), rms_mm=float(singular[-1] / np.sqrt(len(points_mm))))


def fit_cylinder(points_mm: FloatArray, point_mm: FloatArray, axis: FloatArray, radius_mm: float) -> CylinderFit | None:
    """The cylinder of least orthogonal distances to points (n >= 6, 3), from a start near it (Levenberg–Marquardt).

    None where the points do not determine one (all in a plane, on a line, too few).
    """
    if len(points_mm) < 6:
        return None
    centroid = points_mm.mean(axis=0)
    spread = float(np.sqrt(((points_mm - centroid) ** 2).sum(axis=1).mean()))
    if spread <= 0:
        return None
    points = (points_mm - centroid) / spread  # (n, 3), of size 1
    point, direction, radius, cost, normal = least_squares_cylinder(
        points, (point_mm - centroid) / spread, axis / np.linalg.norm(axis), radius_mm / spread, _ITERATIONS
    )
    if not radius > 0 or np.linalg.cond(normal) > _SINGULAR:
        return None
    covariance = cost / max(len(points) - 5, 1) * np.linalg.inv(normal)
    return CylinderFit(
        point_mm=point * spread + centroid,
        axis=direction,
        radius_mm=radius * spread,
        rms_mm=float(np.sqrt(cost / len(points))) * spread,
        radius_sigma_mm=float(np.sqrt(max(covariance[4, 4], 0.0))) * spread,
        axis_sigma_rad=float(np.sqrt(max(covariance[0, 0] + covariance[1, 1], 0.0))),
    )


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def least_squares_cylinder(
    points: FloatArray, point: FloatArray, axis: FloatArray, radius: float, iterations: int
) -> tuple[FloatArray, FloatArray, float, float, FloatArray]:
    """Levenberg–Marquardt over two tilts of the axis, two shifts and the radius; compiled, to be called from compiled code.

    Points (n, 3) of size about 1 around the origin; returns the point of the axis nearest to the origin, axis, radius,
    sum of squares and JᵀJ.
    """
    point, axis = point.copy(), axis.copy()
    new_point, new_axis = np.empty(3), np.empty(3)
    normal, gradient, step, frame = np.empty((5, 5)), np.empty(5), np.empty(5), np.empty((2, 3))
    new_normal, new_gradient, new_frame, factor = np.empty((5, 5)), np.empty(5), np.empty((2, 3)), np.empty((5, 5))
    cost = _normal_equations(points, point, axis, radius, normal, gradient, frame)
    damping = 1e-3
    for _ in range(iterations):
        _solve_damped(normal, gradient, damping, 1e-15 * len(points), factor, step)
        length = 0.0
        for k in range(3):
            new_axis[k] = axis[k] + step[0] * frame[0, k] + step[1] * frame[1, k]
            new_point[k] = point[k] + step[2] * frame[0, k] + step[3] * frame[1, k]
            length += new_axis[k] * new_axis[k]
        along = 0.0
        for k in range(3):
            new_axis[k] /= np.sqrt(length)
            along += new_axis[k] * new_point[k]
        for k in range(3):
            new_point[k] -= along * new_axis[k]
        new_radius = radius + step[4]
        trial = _normal_equations(points, new_point, new_axis, new_radius, new_normal, new_gradient, new_frame)
        if trial <= cost:
            done = cost - trial <= _CONVERGED * cost or trial <= _CONVERGED**2 * len(points)
            cost, radius = trial, new_radius
            point, new_point, axis, new_axis = new_point, point, new_axis, axis
            normal, new_normal, gradient, new_gradient = new_normal, normal, new_gradient, gradient
            frame, new_frame = new_frame, frame
            damping = max(damping / 10.0, 1e-12)
            if done:
                break
        else:
            damping *= 10.0
            if damping > 1e8:
                break
    return point, axis, radius, cost, normal


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _solve_damped(
    normal: FloatArray, gradient: FloatArray, damping: float, least: float, factor: FloatArray, step: FloatArray
) -> None:
    """Cholesky on the normal matrix, its diagonal enlarged."""
    for i in range(5):
        for j in range(i + 1):
            total = normal[i, j] + (normal[i, i] * damping + least if i == j else 0.0)
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = np.sqrt(max(total, 1e-300)) if i == j else total / factor[j, j]
    for i in range(5):
        total = gradient[i]
        for k in range(i):
            total -= factor[i, k] * step[k]
        step[i] = total / factor[i, i]
    for i in range(4, -1, -1):
        total = step[i]
        for k in range(i + 1, 5):
            total -= factor[k, i] * step[k]
        step[i] = total / factor[i, i]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def perpendiculars(axis: FloatArray, frame: FloatArray) -> None:
    """Write two unit vectors across the axis and each other to `frame` (2, 3)."""
    least = 0
    for k in range(1, 3):
        if abs(axis[k]) < abs(axis[least]):
            least = k
    length = 0.0
    for k in range(3):
        frame[0, k] = (1.0 if k == least else 0.0) - axis[least] * axis[k]
        length += frame[0, k] * frame[0, k]
    for k in range(3):
        frame[0, k] /= np.sqrt(length)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame[1, k] = axis[i] * frame[0, j] - axis[j] * frame[0, i]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _normal_equations(
    points: FloatArray,
    point: FloatArray,
    axis: FloatArray,
    radius: float,
    normal: FloatArray,
    gradient: FloatArray,
    frame: FloatArray,
) -> float:
    """The sum of squared distances; writes JᵀJ (5, 5), −Jᵀd (5,) and the two directions of tilt and shift (2, 3)."""
    perpendiculars(axis, frame)
    u, v, w, p = frame[0], frame[1], axis, point
    cost = s00 = s01 = s02 = s03 = s04 = s11 = s12 = s13 = s14 = s22 = s23 = s24 = s33 = s34 = 0.0
    g0 = g1 = g2 = g3 = g4 = 0.0
    for i in range(len(points)):
        dx, dy, dz = points[i, 0] - p[0], points[i, 1] - p[1], points[i, 2] - p[2]
        x = dx * u[0] + dy * u[1] + dz * u[2]
        y = dx * v[0] + dy * v[1] + dz * v[2]
        z = dx * w[0] + dy * w[1] + dz * w[2]
        length = max(np.sqrt(x * x + y * y), 1e-300)
        c, s, d = x / length, y / length, length - radius
        zc, zs = z * c, z * s
        cost += d * d
        s00 += zc * zc
        s01 += zc * zs
        s02 += zc * c
        s03 += zc * s
        s04 += zc
        s11 += zs * zs
        s12 += zs * c
        s13 += zs * s
        s14 += zs
        s22 += c * c
        s23 += c * s
        s24 += c
        s33 += s * s
        s34 += s
        g0 += zc * d
        g1 += zs * d
        g2 += c * d
        g3 += s * d
        g4 += d
    upper = (s00, s01, s02, s03, s04, s11, s12, s13, s14, s22, s23, s24, s33, s34, float(len(points)))
    at = 0
    for a in range(5):
        for b in range(a, 5):
            normal[a, b] = normal[b, a] = upper[at]
            at += 1
    gradient[0], gradient[1], gradient[2], gradient[3], gradient[4] = g0, g1, g2, g3, g4
    return cost
