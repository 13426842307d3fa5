"""Least squares and consensus (RANSAC) for planes and cylinders. Lengths in mm; every result scales with its input."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.facets import coplanar_patches
from gripwright.geometry.frames import any_perpendicular

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
    point, direction, radius, cost, normal = _least_squares(
        points, (point_mm - centroid) / spread, axis / np.linalg.norm(axis), radius_mm / spread
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


@njit(cache=True)  # type: ignore[untyped-decorator]
def _least_squares(
    points: FloatArray, point: FloatArray, axis: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray, float, float, FloatArray]:
    """Levenberg–Marquardt over two tilts of the axis, two shifts and the radius.

    Points (n, 3) around their centroid; returns the point of the axis nearest to it, axis, radius, sum of squares and JᵀJ.
    """
    cost, normal, gradient, e1, e2 = _normal_equations(points, point, axis, radius)
    damping = 1e-3
    for _ in range(_ITERATIONS):
        damped = normal + np.diag(np.diag(normal)) * damping + np.eye(5) * (1e-15 * len(points))
        step = np.linalg.solve(damped, gradient)
        new_axis = axis + step[0] * e1 + step[1] * e2
        new_axis /= np.sqrt((new_axis * new_axis).sum())
        new_point = point + step[2] * e1 + step[3] * e2
        new_point = new_point - new_axis * (new_point * new_axis).sum()
        new_radius = radius + step[4]
        trial = _normal_equations(points, new_point, new_axis, new_radius)
        if trial[0] <= cost:
            done = cost - trial[0] <= _CONVERGED * cost or trial[0] <= _CONVERGED**2 * len(points)
            cost, normal, gradient, e1, e2 = trial
            point, axis, radius = new_point, new_axis, new_radius
            damping = max(damping / 10.0, 1e-12)
            if done:
                break
        else:
            damping *= 10.0
            if damping > 1e8:
                break
    return point, axis, radius, cost, normal


@njit(cache=True)  # type: ignore[untyped-decorator]
def _normal_equations(
    points: FloatArray, point: FloatArray, axis: FloatArray, radius: float
) -> tuple[float, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Sum of squared distances, JᵀJ (5, 5), −Jᵀd (5,) and the two directions of tilt and shift."""
    least = 0
    for k in range(1, 3):
        if abs(axis[k]) < abs(axis[least]):
            least = k
    e1 = -axis[least] * axis
    e1[least] += 1.0
    e1 /= np.sqrt((e1 * e1).sum())
    e2 = np.cross(axis, e1)
    normal, gradient, row, cost = np.zeros((5, 5)), np.zeros(5), np.empty(5), 0.0
    row[4] = -1.0
    for i in range(len(points)):
        vx, vy, vz = points[i, 0] - point[0], points[i, 1] - point[1], points[i, 2] - point[2]
        x = vx * e1[0] + vy * e1[1] + vz * e1[2]
        y = vx * e2[0] + vy * e2[1] + vz * e2[2]
        z = vx * axis[0] + vy * axis[1] + vz * axis[2]
        length = max(np.sqrt(x * x + y * y), 1e-300)
        row[2], row[3] = -x / length, -y / length
        row[0], row[1] = z * row[2], z * row[3]
        distance = length - radius
        cost += distance * distance
        for a in range(5):
            gradient[a] -= row[a] * distance
            for b in range(a + 1):
                normal[a, b] += row[a] * row[b]
    for a in range(5):
        for b in range(a):
            normal[b, a] = normal[a, b]
    return cost, normal, gradient, e1, e2


def cylinder_from_curvature(points_mm: FloatArray) -> tuple[FloatArray, FloatArray, float] | None:
    """Start (point, axis, radius) for an arc of less than a half turn, from the quadratic height field over its mean plane.

    Robust (iteratively reweighted), independent of normals. None where the points are flat.
    """
    centroid = np.median(points_mm, axis=0)
    plane = fit_plane(points_mm)
    e1 = any_perpendicular(plane.normal)
    e2 = np.cross(plane.normal, e1)
    v = points_mm - centroid
    size = float(np.abs(v).max())
    x, y, z = v @ e1 / size, v @ e2 / size, v @ plane.normal / size
    terms = np.stack([x * x / 2, x * y, y * y / 2, x, y, np.ones_like(x)], axis=1)  # (n, 6)
    weight = np.ones_like(z)
    for _ in range(8):
        coefficients = np.linalg.lstsq(terms * weight[:, None], z * weight, rcond=None)[0]
        residual = z - terms @ coefficients
        scale = 1.4826 * float(np.median(np.abs(residual))) + 1e-9
        weight = 1.0 / (1.0 + (residual / (2.0 * scale)) ** 2)
    values, vectors = np.linalg.eigh(np.array([[coefficients[0], coefficients[1]], [coefficients[1], coefficients[2]]]))
    bent = int(np.argmax(np.abs(values)))
    curvature = float(values[bent])
    if abs(curvature) < 1e-6:
        return None
    normal = plane.normal - coefficients[3] * e1 - coefficients[4] * e2
    normal /= np.linalg.norm(normal)
    axis = vectors[0, 1 - bent] * e1 + vectors[1, 1 - bent] * e2
    axis -= normal * (axis @ normal)
    radius = size / abs(curvature)
    foot = centroid + plane.normal * coefficients[5] * size
    return foot + normal * np.sign(curvature) * radius, axis / np.linalg.norm(axis), radius


def corner_vertices(mesh: Mesh, vertices: IntArray) -> IntArray:
    """Those of the given vertices that are corners of the planar patches they lie on, ascending.

    A tessellated curved surface has its corners on the true surface; vertices put inside its facets or along their edges
    (by refinement, say) lie on chords and would bias a fit.
    """
    wanted = np.zeros(len(mesh.vertices_mm), dtype=bool)
    wanted[vertices] = True
    star = np.flatnonzero(wanted[mesh.faces].any(axis=1))  # every face around a wanted vertex
    patches = coplanar_patches(mesh, star)
    corners = mesh.vertices_mm[mesh.faces[star]]  # (s, 3, 3)
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    angles = np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), (ahead * behind).sum(axis=2))  # (s, 3)
    key = (patches[:, None] * len(mesh.vertices_mm) + mesh.faces[star]).ravel()
    unique, inverse = np.unique(key, return_inverse=True)
    total = np.bincount(inverse, angles.ravel())
    is_corner = np.zeros(len(mesh.vertices_mm), dtype=bool)
    is_corner[unique[total < np.pi - 0.02] % len(mesh.vertices_mm)] = True
    return np.flatnonzero(is_corner & wanted)
