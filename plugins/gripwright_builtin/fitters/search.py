"""The cylinders that a segment's surface follows: consensus proposes, least squares on the true corners decides."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.consensus import LARGEST_RADIUS, SurfaceSamples, propose_cylinders, sample_surface, smoothed, support_mm2
from gripwright.geometry.measures import face_areas_mm2, face_normals
from gripwright.geometry.corners import corner_vertices
from gripwright.geometry.surfaces import CylinderFit, cylinder_from_curvature, fit_cylinder
from gripwright_builtin.fitters.lateral import (
    FACET_MAX_RAD,
    TILT_MAX,
    FaceSet,
    Lateral,
    angles_about,
    facet_width_rad,
    lateral_surface,
    upright,
    weighted_median,
)

_SAMPLES = 700
_POINTS = 20000
_TRIES = 3  # cylinders looked for, of each sign
_POLISHED = 2  # of each sign
_ROUNDS = 4
_ACROSS = 0.9  # of a normal along the axis: an end face
_CHORD = 1.0 - float(np.cos(FACET_MAX_RAD / 2.0))  # of the radius: how deep the widest facet lies
_FAR = 0.02  # of the segment's size: surface farther from a cylinder does not speak for it
_FAR_OF_RADIUS = 0.1
_EXACT = 1e-6  # of the segment's size: rounding of CAD files
_CLEAN = 1e-3  # of the radius: deviation below which the surface carries no noise
_CLEAN_SHARE = 0.1  # of the drawn area that must be so for the segment to count as clean
_ONE_WAY = 0.75  # cosine between a part's mean direction and its normals
_SLICES = 12  # along the axis
_ASTRAY = 3.5  # standard errors of a slice's mean


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundCylinder:
    """A cylinder, whether the surface faces away from its axis (+1) or towards it (−1), and the surface that follows it."""

    fit: CylinderFit
    sign: float
    lateral: Lateral
    around_mm2: float  # area of the segment without end faces
    score: float  # area of the surface times the digits of its closeness


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Surface:
    """Some faces of a mesh; `size_mm` is the extent of the segment that they are drawn from."""

    mesh: Mesh
    ids: IntArray  # (k,)
    faces: FaceSet
    size_mm: float
    corners: BoolArray | None  # (n,) true corners among the mesh's vertices, None: not known yet

    def points(self, which: BoolArray) -> tuple[FloatArray, FloatArray]:
        """True corners of some faces (p, 3), at most some thousand, each with its share of the faces' area (p,)."""
        ids, areas = self.ids[which], self.faces.areas_mm2[which]
        weights = np.bincount(self.mesh.faces[ids].ravel(), np.repeat(areas / 3.0, 3), len(self.mesh.vertices_mm))
        vertices = np.flatnonzero(weights)
        vertices = vertices[:: len(vertices) // _POINTS + 1]
        vertices = corner_vertices(self.mesh, vertices) if self.corners is None else vertices[self.corners[vertices]]
        return self.mesh.vertices_mm[vertices], np.asarray(weights[vertices], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fitted:
    fit: CylinderFit
    sign: float
    facet_rad: float
    area_mm2: float
    score: float


def find_cylinders(mesh: Mesh, ids: IntArray, rng: np.random.Generator) -> list[FoundCylinder]:
    """The cylinders that faces `ids` follow, both signs; the best first, the score being the judge."""
    whole = _surface(mesh, ids)
    origin = whole.faces.centres_mm.mean(axis=0)
    samples = sample_surface(whole.faces.centres_mm - origin, whole.faces.normals, whole.faces.areas_mm2, _SAMPLES, rng)
    if len(samples.areas_mm2) < 3:
        return []
    drawn = _drawn(whole, np.unique(samples.faces))
    fitted = list(_fitted(drawn, samples, origin, rng))
    enough = _CLEAN_SHARE * float(drawn.faces.areas_mm2.sum())
    if not any(f.fit.rms_mm < _CLEAN * min(f.fit.radius_mm, whole.size_mm) and f.area_mm2 > enough for f in fitted):
        fitted += list(_fitted(drawn, smoothed(samples), origin, rng))
        fitted += list(_bent(drawn))
    found: list[FoundCylinder] = []
    for sign in (1.0, -1.0):
        of_sign = sorted((f for f in fitted if f.sign == sign), key=lambda f: -f.score)
        polished = (_polished(whole, f) for f in _distinct(of_sign)[:_POLISHED])
        found += [p for p in polished if p is not None]
    return sorted(found, key=lambda f: -f.score)


def _surface(mesh: Mesh, ids: IntArray) -> _Surface:
    part = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[ids])
    triangles = part.triangles_mm
    faces = FaceSet(
        triangles_mm=triangles, centres_mm=triangles.mean(axis=1), normals=face_normals(part), areas_mm2=face_areas_mm2(part)
    )
    return _Surface(mesh=mesh, ids=ids, faces=faces, size_mm=float(np.ptp(triangles.reshape(-1, 3), axis=0).max()), corners=None)


def _drawn(whole: _Surface, which: IntArray) -> _Surface:
    """Some faces of a surface, their true corners worked out once."""
    faces = whole.faces
    ids = whole.ids[which]
    corners = np.zeros(len(whole.mesh.vertices_mm), dtype=bool)
    corners[corner_vertices(whole.mesh, np.unique(whole.mesh.faces[ids]))] = True
    part = FaceSet(
        triangles_mm=faces.triangles_mm[which],
        centres_mm=faces.centres_mm[which],
        normals=faces.normals[which],
        areas_mm2=faces.areas_mm2[which],
    )
    return _Surface(mesh=whole.mesh, ids=ids, faces=part, size_mm=whole.size_mm, corners=corners)


def _fitted(surface: _Surface, samples: SurfaceSamples, origin: FloatArray, rng: np.random.Generator) -> Iterator[_Fitted]:
    """Cylinders of both signs, each the best explanation of what the earlier ones of its sign left over."""
    proposals = propose_cylinders(samples, rng)
    supports = support_mm2(samples, proposals)  # (h, s)
    for sign in (1.0, -1.0):
        remaining = supports[proposals.signs == sign]
        of_sign = proposals.select(proposals.signs == sign)
        for _ in range(_TRIES):
            total = remaining.sum(axis=1)
            if not len(total) or total.max() <= 0.01 * samples.areas_mm2.sum():
                break
            chosen = int(np.argmax(total))
            start = _start(of_sign.points_mm[chosen] + origin, of_sign.axes[chosen], float(of_sign.radii_mm[chosen]))
            fitted = _refined(surface, start, sign)
            if fitted is not None:
                yield fitted
            remaining[:, remaining[chosen] > 0] = 0.0


def _bent(surface: _Surface) -> Iterator[_Fitted]:
    """Cylinders that osculate the parts that face one way: what is left to try where noise hides the normals of short arcs."""
    faces = surface.faces
    remaining = faces.areas_mm2.copy()
    for _ in range(_TRIES):
        mean = remaining @ faces.normals if remaining.any() else np.zeros(3)
        if not np.linalg.norm(mean) > 0.1 * remaining.sum():
            mean = faces.normals[int(np.argmax(remaining))]
        for _ in range(3):  # towards the middle of the part
            part = faces.normals @ (mean / max(float(np.linalg.norm(mean)), 1e-300)) > _ONE_WAY
            mean = (remaining * part) @ faces.normals
        if part.sum() < 6 or not remaining[part].sum() > 0:
            return
        bent = cylinder_from_curvature(faces.centres_mm[part])
        remaining[part] = 0.0
        if bent is None:
            continue
        start = _start(*bent)
        outwards = (faces.normals[part] * start.radial_mm(faces.centres_mm[part])).sum(axis=1)
        fitted = _refined(surface, start, 1.0 if faces.areas_mm2[part] @ outwards > 0 else -1.0)
        if fitted is not None:
            yield fitted


def _start(point_mm: FloatArray, axis: FloatArray, radius_mm: float) -> CylinderFit:
    return CylinderFit(point_mm=point_mm, axis=axis, radius_mm=radius_mm, rms_mm=0.0, radius_sigma_mm=0.0, axis_sigma_rad=0.0)


def _refined(surface: _Surface, start: CylinderFit, sign: float) -> _Fitted | None:
    """Least squares from a start, on the corners of the faces that follow it; twice, since better knows better which do."""
    fit, band = start, min(_FAR * surface.size_mm, _FAR_OF_RADIUS * start.radius_mm)
    for _ in range(2):
        near = _following(surface.faces, fit, sign, band)
        points, weights = surface.points(near)
        trimmed = _trimmed(points, weights, fit, surface.size_mm)
        if trimmed is None or trimmed[0].radius_mm > LARGEST_RADIUS * surface.size_mm:
            return None
        fit, kept = trimmed
        band = _tolerance_mm(fit)
    levelled = _levelled(points[kept], fit, sign)
    fit = fit if levelled is None else levelled
    distances = np.abs(fit.distances_mm(surface.faces.triangles_mm[near].reshape(-1, 3))).reshape(-1, 3).max(axis=1)
    digits = np.log(_FAR * surface.size_mm / np.maximum(distances, 10.0 * _EXACT * surface.size_mm))
    return _Fitted(
        fit=fit,
        sign=sign,
        facet_rad=facet_width_rad(angles_about(points[kept], fit)),
        area_mm2=float(surface.faces.areas_mm2[near].sum()),
        score=float(surface.faces.areas_mm2[near] @ np.maximum(digits, 0.0)),
    )


def _polished(whole: _Surface, rough: _Fitted) -> FoundCylinder | None:
    """The same on the whole segment, with the surface that follows it; None where that surface is a prism's."""
    exact = rough.fit.rms_mm < 10.0 * _EXACT * whole.size_mm  # more points would tell nothing
    fitted = rough if exact else _refined(whole, rough.fit, rough.sign)
    if fitted is None or fitted.facet_rad <= 0:
        return None
    lateral = lateral_surface(whole.faces, fitted.fit, fitted.sign, _tolerance_mm(fitted.fit), fitted.facet_rad)
    if lateral is None:
        return None
    around = np.abs(whole.faces.normals @ fitted.fit.axis) < _ACROSS
    return FoundCylinder(
        fit=fitted.fit,
        sign=fitted.sign,
        lateral=lateral,
        around_mm2=float(whole.faces.areas_mm2[around].sum()),
        score=fitted.score,
    )


def _tolerance_mm(fit: CylinderFit) -> float:
    return max(4.0 * fit.rms_mm, _CLEAN * fit.radius_mm)


def _distinct(fitted: list[_Fitted]) -> list[_Fitted]:
    kept: list[_Fitted] = []
    for one in fitted:
        if not any(_same(one.fit, other.fit) for other in kept):
            kept.append(one)
    return kept


def _same(a: CylinderFit, b: CylinderFit) -> bool:
    near = float(np.linalg.norm(a.radial_mm(b.point_mm[None])[0]))
    return bool(abs(a.axis @ b.axis) > 0.999 and abs(a.radius_mm - b.radius_mm) + near < 0.02 * a.radius_mm)


def _following(faces: FaceSet, fit: CylinderFit, sign: float, band_mm: float) -> BoolArray:
    """Faces near the cylinder, facing as it does. Half of their area says how much normals may tilt along the axis."""
    radial = fit.radial_mm(faces.centres_mm)
    distance = np.maximum(np.linalg.norm(radial, axis=1), 1e-300)
    outwards = (faces.normals * radial).sum(axis=1) / distance * sign
    depth = fit.radius_mm - distance
    tilt = np.abs(faces.normals @ fit.axis)
    near = (outwards > 0.5) & (depth >= -band_mm) & (depth <= band_mm + _CHORD * fit.radius_mm) & (tilt < TILT_MAX)
    return upright(near, tilt, faces.areas_mm2)


def _trimmed(points: FloatArray, weights: FloatArray, start: CylinderFit, size_mm: float) -> tuple[CylinderFit, BoolArray] | None:
    """Least squares with the points left out that are far off for the median (by area) distance; and which were kept."""
    kept = np.ones(len(points), dtype=bool)
    fit = start
    for _ in range(_ROUNDS):
        better = fit_cylinder(points[kept], fit.point_mm, fit.axis, fit.radius_mm)
        if better is None:
            return None
        fit = better
        distance = np.abs(fit.distances_mm(points))
        limit = max(3.5 * 1.4826 * weighted_median(distance[kept], weights[kept]), _EXACT * size_mm)
        now = distance <= limit
        if (now == kept).all():
            break
        kept = now
    return fit, kept


def _levelled(points: FloatArray, fit: CylinderFit, sign: float) -> CylinderFit | None:
    """The fit without the slices at either end that recede from it: fillets that hide in the noise. None where none do."""
    along = (points - fit.point_mm) @ fit.axis
    low, length = float(along.min()), float(np.ptp(along))
    slices = np.minimum(((along - low) / max(length, 1e-300) * _SLICES).astype(np.int64), _SLICES - 1)
    count = np.bincount(slices, minlength=_SLICES)
    level: CylinderFit | None = None
    for _ in range(3):
        distances = (level or fit).distances_mm(points) * sign
        mean = np.bincount(slices, distances, _SLICES) / np.maximum(count, 1)
        error = (level or fit).rms_mm / np.sqrt(np.maximum(count, 1))
        straight = (mean > -_ASTRAY * error) & (count > 0)
        if not straight.any():
            return level
        first, last = int(np.argmax(straight)), _SLICES - 1 - int(np.argmax(straight[::-1]))
        middle = (slices >= first) & (slices <= last)
        if middle.all() or middle.sum() < len(points) // 3:
            return level
        now = level or fit
        level = fit_cylinder(points[middle], now.point_mm, now.axis, now.radius_mm) or level
    return level
