"""Axes about which a component's surface may repeat itself, and its faces seen from such an axis."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.domain.assembly import Component
from gripwright.domain.shape import FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.consensus import SurfaceSamples, propose_cylinders, sample_surface, support_mm2
from gripwright.geometry.frames import any_perpendicular
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, face_normals

_SAMPLES = 1200
_CYLINDERS = 8  # axes taken from cylinders
_SEGMENT_SHARE = 0.01  # of the component's area: smaller segments are not asked for an axis
_REWEIGHTS = 20
_SAME_DIRECTION = 0.9995
_SAME_PLACE = 0.01  # of the component's size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Faces:
    """Corners, centres, normals and areas of a component's faces."""

    triangles_C: FloatArray  # (m, 3, 3)
    centres_C: FloatArray  # (m, 3)
    normals_C: FloatArray  # (m, 3)
    areas_mm2: FloatArray  # (m,)

    @classmethod
    def of(cls, mesh: Mesh) -> "Faces":
        """All faces of a mesh."""
        return cls(
            triangles_C=mesh.triangles_mm,
            centres_C=face_centres_mm(mesh),
            normals_C=face_normals(mesh),
            areas_mm2=face_areas_mm2(mesh),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Axis:
    """A line in the component's frame."""

    point_C: FloatArray  # (3,)
    direction_C: FloatArray  # (3,) unit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """Faces in cylindrical coordinates about an axis; normals split into radial, tangential and axial parts. All (m,)."""

    along_mm: FloatArray  # of the centre
    low_mm: FloatArray  # of the lowest corner
    high_mm: FloatArray  # of the highest
    angle_rad: FloatArray  # 0..2π
    radius_mm: FloatArray  # of the centre
    inner_mm: FloatArray  # of the corner nearest to the axis
    outer_mm: FloatArray  # of the farthest
    radial: FloatArray
    tangential: FloatArray
    axial: FloatArray
    areas_mm2: FloatArray

    @classmethod
    def about(cls, axis: Axis, faces: Faces) -> "View":
        """The faces seen from an axis."""
        e1 = any_perpendicular(axis.direction_C)
        e2 = np.cross(axis.direction_C, e1)
        v = faces.centres_C - axis.point_C
        x, y = v @ e1, v @ e2
        radius = np.maximum(np.hypot(x, y), 1e-300)
        nx, ny = faces.normals_C @ e1, faces.normals_C @ e2
        corners = faces.triangles_C - axis.point_C  # (m, 3, 3)
        heights, reach = corners @ axis.direction_C, np.hypot(corners @ e1, corners @ e2)  # (m, 3)
        return cls(
            low_mm=heights.min(axis=1),
            high_mm=heights.max(axis=1),
            along_mm=v @ axis.direction_C,
            angle_rad=np.mod(np.arctan2(y, x), 2.0 * np.pi),
            radius_mm=radius,
            inner_mm=reach.min(axis=1),
            outer_mm=reach.max(axis=1),
            radial=(nx * x + ny * y) / radius,
            tangential=(ny * x - nx * y) / radius,
            axial=faces.normals_C @ axis.direction_C,
            areas_mm2=faces.areas_mm2,
        )


def candidate_axes(component: Component, segments: Sequence[Segment], faces: Faces, rng: np.random.Generator) -> list[Axis]:
    """Axes of the cylinders in the surface, and of the turning or screwing motions that carry it or a segment into itself."""
    size = float(np.ptp(faces.centres_C, axis=0).max())
    found: list[Axis] = []
    for axis in _proposed(component, segments, faces, rng):
        if not any(_same(axis, other, size) for other in found):
            found.append(axis)
    return found


def _proposed(component: Component, segments: Sequence[Segment], faces: Faces, rng: np.random.Generator) -> Iterator[Axis]:
    origin = faces.centres_C.mean(axis=0)
    everything = np.arange(len(faces.areas_mm2))
    parts = [everything, *(s.faces for s in segments if s.area_mm2 >= _SEGMENT_SHARE * faces.areas_mm2.sum())]
    drawn = [
        sample_surface(faces.centres_C[part] - origin, faces.normals_C[part], faces.areas_mm2[part], _SAMPLES, rng)
        for part in parts
    ]
    for samples in drawn:
        yield from _motion_axis(samples, origin)
    if len(drawn[0].areas_mm2) >= 3:
        yield from _cylinder_axes(drawn[0], origin, rng)


def _cylinder_axes(samples: SurfaceSamples, origin: FloatArray, rng: np.random.Generator) -> Iterator[Axis]:
    proposals = propose_cylinders(samples, rng)
    remaining = support_mm2(samples, proposals)  # (h, s)
    for _ in range(_CYLINDERS):
        total = remaining.sum(axis=1)
        if not len(total) or total.max() <= 0:
            return
        chosen = int(np.argmax(total))
        yield Axis(point_C=proposals.points_mm[chosen] + origin, direction_C=proposals.axes[chosen])
        remaining[:, remaining[chosen] > 0] = 0.0


def _motion_axis(samples: SurfaceSamples, origin: FloatArray) -> Iterator[Axis]:
    """Axis of the screw motion whose velocity c̄ + c × x is most nearly tangential to the surface (its line complex)."""
    x, n, area = samples.points_mm, samples.normals, samples.areas_mm2
    if not area.sum() > 0:
        return
    centre = area @ x / area.sum()
    size = float(np.sqrt(area @ ((x - centre) ** 2).sum(axis=1) / area.sum()))
    if not size > 0:
        return
    moment = np.cross((x - centre) / size, n)  # (k, 3)
    rows = np.concatenate([moment, n], axis=1)  # (k, 6)
    weight = area.copy()
    for _ in range(_REWEIGHTS):
        M = rows.T @ (rows * weight[:, None])
        inverse = np.linalg.pinv(M[3:, 3:], rcond=1e-9, hermitian=True)
        turn = np.linalg.eigh(M[:3, :3] - M[:3, 3:] @ inverse @ M[3:, :3])[1][:, 0]  # (3,) c
        shift = -inverse @ M[3:, :3] @ turn  # (3,) c̄
        residual = np.abs(rows @ np.concatenate([turn, shift]))
        scale = max(float(np.median(residual)), 1e-4)
        weight = area / (1.0 + (residual / scale) ** 2)
    yield Axis(point_C=origin + centre + size * np.cross(turn, shift), direction_C=turn)


def _same(a: Axis, b: Axis, size_mm: float) -> bool:
    apart = b.point_C - a.point_C
    apart = apart - a.direction_C * (apart @ a.direction_C)
    return bool(abs(a.direction_C @ b.direction_C) > _SAME_DIRECTION and np.linalg.norm(apart) < _SAME_PLACE * size_mm)


def runs(lows: FloatArray, highs: FloatArray, items: IntArray, gap: float) -> list[IntArray]:
    """The items in groups between which the union of their intervals leaves a gap wider than `gap`."""
    if not len(items):
        return []
    order = items[np.argsort(lows[items], kind="stable")]
    reach = np.maximum.accumulate(highs[order])
    return np.split(order, np.flatnonzero(lows[order][1:] - reach[:-1] > gap) + 1)
