"""Consensus (RANSAC) on oriented surface samples: which cylinders explain a surface. Lengths in mm, scale-free."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from gripwright.domain.shape import BoolArray, FloatArray, IntArray

_PAIRS = 500
_ALONG_CAPS = 60  # pairs for each direction taken as an end face's
_CAPS = 4
_BAND = 0.01  # of the samples' size: distance at which a sample stops to count
_BAND_OF_RADIUS = 0.08
_NORMAL_COSINE = 0.75  # between a sample's normal and the radial direction
_TILT = 0.35  # of a sample's normal along the axis
LARGEST_RADIUS = 5.0  # of the samples' size: less than 12° of arc cannot be told from a plane


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceSamples:
    """Points with outward unit normals and the area each stands for."""

    faces: IntArray  # (s,) where each comes from
    points_mm: FloatArray  # (s, 3)
    normals: FloatArray  # (s, 3)
    areas_mm2: FloatArray  # (s,)
    directions: IntArray  # (s,) number of the direction, shared by samples with nearly the same normal

    @property
    def size_mm(self) -> float:
        """Largest extent of the points."""
        return float(np.ptp(self.points_mm, axis=0).max())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CylinderHypotheses:
    """Signed cylinders: sign +1 where the normals point away from the axis (a boss), −1 towards it (a bore)."""

    points_mm: FloatArray  # (h, 3), perpendicular to the axes
    axes: FloatArray  # (h, 3) unit
    radii_mm: FloatArray  # (h,)
    signs: FloatArray  # (h,)

    def select(self, which: BoolArray | IntArray) -> "CylinderHypotheses":
        """Some of them."""
        return CylinderHypotheses(
            points_mm=self.points_mm[which], axes=self.axes[which], radii_mm=self.radii_mm[which], signs=self.signs[which]
        )


def sample_surface(
    points_mm: FloatArray, normals: FloatArray, areas_mm2: FloatArray, count: int, rng: np.random.Generator
) -> SurfaceSamples:
    """At most `count` of the given faces (centres, normals, areas).

    Half of them are drawn by area, half with one voice a direction, so that narrow facets are heard beside wide planes;
    each stands for the area that makes sums over the samples unbiased.
    """
    usable = np.flatnonzero(areas_mm2 > 0)
    directions = _directions(normals[usable])
    areas = areas_mm2[usable]
    if len(usable) > count:
        weight = _voices(areas, directions)
        drawn = rng.choice(len(usable), count, p=weight)
        usable, directions, areas = usable[drawn], directions[drawn], areas[drawn] / (weight[drawn] * count)
    return SurfaceSamples(
        faces=usable, points_mm=points_mm[usable], normals=normals[usable], areas_mm2=areas, directions=directions
    )


def _directions(normals: FloatArray) -> IntArray:
    cell = np.rint(normals * 50.0).astype(np.int64) + 64  # (s, 3), about one degree
    return np.asarray(np.unique(cell @ np.array([1 << 16, 1 << 8, 1]), return_inverse=True)[1], dtype=np.int64)


def _voices(areas_mm2: FloatArray, directions: IntArray) -> FloatArray:
    rarity = 1.0 / np.bincount(directions)[directions]
    weight = areas_mm2 / areas_mm2.sum() + rarity / rarity.sum()
    return np.asarray(weight / weight.sum())


def propose_cylinders(samples: SurfaceSamples, rng: np.random.Generator) -> CylinderHypotheses:
    """Cylinders through pairs of oriented samples.

    Two normals give the axis (their cross product) or, where a plane is taken as an end face, its normal does;
    then two oriented points of a circle give centre and signed radius.
    """
    weight = _voices(samples.areas_mm2, samples.directions)
    pairs = rng.choice(len(weight), size=(_PAIRS, 2), p=weight)
    axes = np.cross(samples.normals[pairs[:, 0]], samples.normals[pairs[:, 1]])
    size = np.linalg.norm(axes, axis=1)
    firm = size > 0.02
    found = [_circles(samples, pairs[firm], axes[firm] / size[firm, None])]
    for direction in np.argsort(-np.bincount(samples.directions, samples.areas_mm2), kind="stable")[:_CAPS]:
        axis = samples.normals[np.argmax(samples.directions == direction)]
        lateral = np.flatnonzero(np.abs(samples.normals @ axis) < 0.1)
        if len(lateral) >= 3:
            pairs = rng.choice(lateral, size=(_ALONG_CAPS, 2))
            found.append(_circles(samples, pairs, np.broadcast_to(axis, (_ALONG_CAPS, 3))))
    return CylinderHypotheses(
        points_mm=np.concatenate([f.points_mm for f in found]),
        axes=np.concatenate([f.axes for f in found]),
        radii_mm=np.concatenate([f.radii_mm for f in found]),
        signs=np.concatenate([f.signs for f in found]),
    )


def _circles(samples: SurfaceSamples, pairs: IntArray, axes: FloatArray) -> CylinderHypotheses:
    def flat(v: FloatArray) -> FloatArray:
        return np.asarray(v - (v * axes).sum(axis=1, keepdims=True) * axes)

    p, n = samples.points_mm[pairs], samples.normals[pairs]  # (h, 2, 3)
    n1, n2 = flat(n[:, 0]), flat(n[:, 1])
    turn = n1 - n2
    square = (turn**2).sum(axis=1)
    p1, p2 = flat(p[:, 0]), flat(p[:, 1])
    radii = np.divide(((p1 - p2) * turn).sum(axis=1), square, out=np.zeros(len(square)), where=square > 1e-6)
    size = samples.size_mm
    good = (np.abs(radii) > 1e-6 * size) & (np.abs(radii) < LARGEST_RADIUS * size)
    centres = ((p1 - radii[:, None] * n1) + (p2 - radii[:, None] * n2)) / 2.0
    return CylinderHypotheses(points_mm=centres[good], axes=axes[good], radii_mm=np.abs(radii[good]), signs=np.sign(radii[good]))


def support_mm2(samples: SurfaceSamples, hypotheses: CylinderHypotheses) -> FloatArray:
    """Area of the samples that follow each hypothesis, (h, s), fading with their distance (MSAC)."""
    band = np.minimum(_BAND * samples.size_mm, _BAND_OF_RADIUS * hypotheses.radii_mm)  # (h,)
    closeness = _closeness(
        samples.points_mm, samples.normals, hypotheses.points_mm, hypotheses.axes, hypotheses.radii_mm, hypotheses.signs, band
    )
    return np.asarray(closeness * samples.areas_mm2)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _closeness(
    points: FloatArray,
    normals: FloatArray,
    centres: FloatArray,
    axes: FloatArray,
    radii: FloatArray,
    signs: FloatArray,
    band: FloatArray,
) -> FloatArray:
    """1 on a hypothesis's surface, 0 from `band` on and where the normal does not fit, (h, s)."""
    result = np.zeros((len(radii), len(points)))
    for h in range(len(radii)):
        ax, ay, az = axes[h]
        for s in range(len(points)):
            nx, ny, nz = normals[s]
            if abs(nx * ax + ny * ay + nz * az) >= _TILT:
                continue
            x, y, z = points[s, 0] - centres[h, 0], points[s, 1] - centres[h, 1], points[s, 2] - centres[h, 2]
            along = x * ax + y * ay + z * az
            x, y, z = x - along * ax, y - along * ay, z - along * az
            distance = np.sqrt(x * x + y * y + z * z)
            if (x * nx + y * ny + z * nz) * signs[h] > _NORMAL_COSINE * distance:
                off = (distance - radii[h]) / band[h]
                result[h, s] = max(1.0 - off * off, 0.0)
    return result
