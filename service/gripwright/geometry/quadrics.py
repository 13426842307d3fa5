"""Planes, cylinders, cones and spheres as one family: hypotheses from oriented points, what follows them, least squares.

Lengths in mm; every result scales with its input. After Schnabel, Wahl and Klein (2007).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from gripwright.domain.shape import BoolArray, FloatArray, IntArray

KINDS = ("plane", "cylinder", "cone", "sphere")
"""From the simplest to the least common; `Quadrics.kinds` counts in this order."""
PLANE, CYLINDER, CONE, SPHERE = range(4)

_DRAWS = 150
_NEAR = 24  # neighbours among which half of the draws find their partners
_RADIUS_MAX = 10.0  # of the points' size: flatter is a plane
_CONE_RAD = (np.radians(3.0), np.radians(85.0))
_STEPS = 60


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Quadrics:
    """Surfaces with an outside. A plane: point and normal; the others: point of the axis (apex, centre), axis, size."""

    kinds: IntArray  # (h,)
    points_mm: FloatArray  # (h, 3)
    axes: FloatArray  # (h, 3) unit
    sizes: FloatArray  # (h,) radius, mm; of a cone the half angle, rad; of a plane 0
    signs: FloatArray  # (h,) +1 a solid, −1 a hollow of that form

    def select(self, which: BoolArray | IntArray) -> "Quadrics":
        """Some of them."""
        return Quadrics(
            kinds=self.kinds[which],
            points_mm=self.points_mm[which],
            axes=self.axes[which],
            sizes=self.sizes[which],
            signs=self.signs[which],
        )


def closeness(
    quadrics: Quadrics, points_mm: FloatArray, normals: FloatArray, tolerances_mm: FloatArray, angle_rad: float
) -> FloatArray:
    """How well oriented points (s, 3) follow each surface, (h, s).

    1 on it, 0 from `tolerances_mm` (s,) on and where the normals differ by more than `angle_rad`.
    """
    q = quadrics
    return np.asarray(
        _closeness(q.kinds, q.points_mm, q.axes, q.sizes, q.signs, points_mm, normals, tolerances_mm, np.cos(angle_rad))
    )


def propose(points_mm: FloatArray, normals: FloatArray, planes: IntArray, rng: np.random.Generator) -> Quadrics:
    """Surfaces through two or three of the oriented points (s >= 2, 3), near to each other and far; planes at `planes`."""
    count = len(points_mm)
    near = cKDTree(points_mm).query(points_mm, k=min(_NEAR, count))[1].reshape(count, -1)
    first = rng.integers(count, size=2 * _DRAWS)
    partners = rng.integers(count, size=(2 * _DRAWS, 2))
    close = near[first[:_DRAWS, None], rng.integers(near.shape[1], size=(_DRAWS, 2))]
    partners[:_DRAWS] = close
    drawn = np.column_stack((first, partners))  # (d, 3)
    size_mm = float(np.ptp(points_mm, axis=0).max())
    flat = Quadrics(
        kinds=np.full(len(planes), PLANE),
        points_mm=points_mm[planes],
        axes=normals[planes],
        sizes=np.zeros(len(planes)),
        signs=np.ones(len(planes)),
    )
    p, n = points_mm[drawn], normals[drawn]  # (d, 3, 3)
    axes = np.cross(n[:, 0], n[:, 1])
    return _joined([flat, _round(CYLINDER, p, n, axes, size_mm), _cones(p, n), _round(SPHERE, p, n, n[:, 0], size_mm)])


def fitted(quadrics: Quadrics, points_mm: FloatArray) -> Quadrics:
    """The one surface given, moved and sized for least squared distances to points (n, 3)."""
    centre = points_mm.mean(axis=0)
    size_mm = float(np.abs(points_mm - centre).max())
    if len(points_mm) < 6 or size_mm <= 0:
        return quadrics
    kind = int(quadrics.kinds[0])
    scale = 1.0 if kind in (PLANE, CONE) else size_mm
    start = np.concatenate(((quadrics.points_mm[0] - centre) / size_mm, quadrics.axes[0], quadrics.sizes / scale))
    local = (points_mm - centre) / size_mm

    def distances(x: FloatArray) -> FloatArray:
        return np.asarray(_distances(kind, x[:3], x[3:6] / np.linalg.norm(x[3:6]), x[6], local))

    found = least_squares(distances, start, max_nfev=_STEPS).x
    return Quadrics(
        kinds=quadrics.kinds,
        points_mm=(found[:3] * size_mm + centre)[None],
        axes=(found[3:6] / np.linalg.norm(found[3:6]))[None],
        sizes=found[6:] * scale,
        signs=quadrics.signs,
    )


def _joined(parts: list[Quadrics]) -> Quadrics:
    return Quadrics(
        kinds=np.concatenate([part.kinds for part in parts]),
        points_mm=np.concatenate([part.points_mm for part in parts]),
        axes=np.concatenate([part.axes for part in parts]),
        sizes=np.concatenate([part.sizes for part in parts]),
        signs=np.concatenate([part.signs for part in parts]),
    )


def _round(kind: int, p: FloatArray, n: FloatArray, axes: FloatArray, size_mm: float) -> Quadrics:
    """Spheres, or cylinders about `axes` (d, 3), whose normals at the first two of the points p (d, 3, 3) are n (d, 3, 3)."""
    length = np.linalg.norm(axes, axis=1)
    axes = axes / np.maximum(length, 1e-12)[:, None]

    def across(v: FloatArray) -> FloatArray:
        return v if kind == SPHERE else np.asarray(v - (v * axes).sum(axis=1, keepdims=True) * axes)

    turn, step = across(n[:, 0] - n[:, 1]), across(p[:, 0] - p[:, 1])
    square = (turn**2).sum(axis=1)
    radii = np.divide((step * turn).sum(axis=1), square, out=np.zeros(len(p)), where=square > 1e-6)
    centres = ((p[:, 0] - radii[:, None] * across(n[:, 0])) + (p[:, 1] - radii[:, None] * across(n[:, 1]))) / 2.0
    good = (length > 0.02) & (np.abs(radii) > 1e-6 * size_mm) & (np.abs(radii) < _RADIUS_MAX * size_mm)
    return Quadrics(
        kinds=np.full(int(good.sum()), kind),
        points_mm=centres[good],
        axes=axes[good],
        sizes=np.abs(radii[good]),
        signs=np.sign(radii[good]),
    )


def _cones(p: FloatArray, n: FloatArray) -> Quadrics:
    """Cones that have the normals n (d, 3, 3) at points p (d, 3, 3)."""
    axes = np.cross(n[:, 0] - n[:, 1], n[:, 0] - n[:, 2])
    length = np.linalg.norm(axes, axis=1)
    firm = (np.abs(np.linalg.det(n)) > 1e-4) & (length > 1e-4)
    p, n, axes = p[firm], n[firm], axes[firm] / length[firm, None]
    apex = np.linalg.solve(n, np.einsum("dij,dij->di", n, p)[..., None])[..., 0]  # the three tangent planes meet there
    away = p - apex[:, None]  # (d, 3, 3)
    along = np.einsum("dij,dj->di", away, axes)
    axes = axes * np.sign(along.sum(axis=1))[:, None]
    along = np.abs(along)
    radial = np.sqrt(np.maximum((away**2).sum(axis=2) - along**2, 0.0))
    angles = np.arctan2(radial.mean(axis=1), along.mean(axis=1))
    signs = -np.sign(np.einsum("dij,dj->d", n, axes))
    good = (angles > _CONE_RAD[0]) & (angles < _CONE_RAD[1]) & (signs != 0)
    return Quadrics(
        kinds=np.full(int(good.sum()), CONE), points_mm=apex[good], axes=axes[good], sizes=angles[good], signs=signs[good]
    )


@njit(cache=True)  # type: ignore[untyped-decorator]
def _place(
    kind: int, point: FloatArray, axis: FloatArray, size: float, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Signed distance of a place from a surface, and the surface's normal there, away from axis or centre."""
    vx, vy, vz = x - point[0], y - point[1], z - point[2]
    along = vx * axis[0] + vy * axis[1] + vz * axis[2]
    if kind == 0:
        return along, axis[0], axis[1], axis[2]
    if kind != 3:
        vx, vy, vz = vx - along * axis[0], vy - along * axis[1], vz - along * axis[2]
    radial = max(np.sqrt(vx * vx + vy * vy + vz * vz), 1e-300)
    vx, vy, vz = vx / radial, vy / radial, vz / radial
    if kind != 2:
        return radial - size, vx, vy, vz
    c, s = np.cos(size), np.sin(size)
    return radial * c - along * s, vx * c - axis[0] * s, vy * c - axis[1] * s, vz * c - axis[2] * s


@njit(cache=True)  # type: ignore[untyped-decorator]
def _distances(kind: int, point: FloatArray, axis: FloatArray, size: float, points: FloatArray) -> FloatArray:
    result = np.empty(len(points))
    for s in range(len(points)):
        result[s] = _place(kind, point, axis, size, points[s, 0], points[s, 1], points[s, 2])[0]
    return result


@njit(cache=True)  # type: ignore[untyped-decorator]
def _closeness(
    kinds: IntArray,
    centres: FloatArray,
    axes: FloatArray,
    sizes: FloatArray,
    signs: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    tolerances: FloatArray,
    cosine: float,
) -> FloatArray:
    result = np.zeros((len(kinds), len(points)))
    for h in range(len(kinds)):
        for s in range(len(points)):
            distance, nx, ny, nz = _place(kinds[h], centres[h], axes[h], sizes[h], points[s, 0], points[s, 1], points[s, 2])
            off = distance / tolerances[s]
            alike = (nx * normals[s, 0] + ny * normals[s, 1] + nz * normals[s, 2]) * signs[h]
            if off * off < 1.0 and alike >= cosine:
                result[h, s] = 1.0 - off * off
    return result
