"""Cylinders: consensus on oriented faces, then least squares on the corners of the true surface (paper, section 4.2)."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import BoolArray, Cylinder, FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.consensus import propose_cylinders, sample_surface, smoothed, support_mm2
from gripwright.geometry.measures import face_areas_mm2, face_normals
from gripwright.geometry.surfaces import CylinderFit, corner_vertices, cylinder_from_curvature, fit_cylinder
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.fitters.lateral import FACET_MAX_RAD, FaceSet, Lateral, angles_about, facet_width_rad, lateral_surface

_SAMPLES = 700
_POINTS = 6000
_TRIES = 3  # cylinders looked for, of each sign
_ROUNDS = 4
_CHORD = 1.0 - float(np.cos(FACET_MAX_RAD / 2.0))  # of the radius: how deep the widest facet lies
_TILT_MAX = 0.7  # of a face's normal along the axis, noise included
_TILT_EXACT = 0.02
_EXACT = 1e-6  # of the segment's size: rounding of CAD files


Start = tuple[FloatArray, FloatArray, float]  # a point on the axis, the axis, the radius in mm


class CylinderParams(Params):
    """What counts as a cylinder that can be held."""

    support_min: float = Field(
        0.05, gt=0, le=1, description="Least share of the segment's area, faces across the axis left out, on the cylinder."
    )
    filled_min: float = Field(0.35, ge=0, le=1, description="Share of the lateral area from which the surface counts as filled.")
    three_finger_min: float = Field(
        0.25, ge=0, le=1, description="Share of the height that each of three fingers, 120 degrees apart, must find."
    )
    rms_max: float = Field(0.03, gt=0, description="Largest root mean square distance, as a share of the radius.")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Candidate:
    fit: CylinderFit
    sign: float
    lateral: Lateral
    score: float  # area on the surface times the digits of its closeness

    @property
    def height_mm(self) -> float:
        return self.lateral.high_mm - self.lateral.low_mm


class CylinderFitter:
    """Fits the cylinder that a gripper would hold: an outer surface before a bore, a filled one before an empty one."""

    key: ClassVar[str] = "cylinder"
    params_model: ClassVar[type[CylinderParams]] = CylinderParams

    def __init__(self, params: CylinderParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Cylinder | Rejection:
        """The cylinder with the standard errors of its radius and axis, or why there is none."""
        mesh = component.mesh
        faces = _face_set(mesh, segment.faces)
        candidates = list(_candidates(mesh, segment.faces, faces, ctx.rng))
        if not candidates:
            return Rejection("no-cylinder", "no part of the surface follows a cylinder")
        best = min(candidates, key=self._rank)
        across = np.abs(faces.normals @ best.fit.axis) > 0.9
        around = float(faces.areas_mm2[~across].sum())
        if best.lateral.area_mm2 < self._params.support_min * around:
            return Rejection(
                "no-cylinder",
                f"{100 * best.lateral.area_mm2 / around:.1f} % of the surface around the axis lies on the best cylinder "
                f"(radius {best.fit.radius_mm:.2f} mm), at least {100 * self._params.support_min:.1f} % needed",
            )
        if best.fit.rms_mm > self._params.rms_max * best.fit.radius_mm:
            return Rejection(
                "not-round",
                f"the surface deviates by {best.fit.rms_mm:.3g} mm from a cylinder of radius {best.fit.radius_mm:.2f} mm, "
                f"at most {self._params.rms_max * best.fit.radius_mm:.3g} mm",
            )
        return Cylinder(
            center_C=best.fit.point_mm + best.fit.axis * (best.lateral.low_mm + best.lateral.high_mm) / 2.0,
            axis_C=best.fit.axis,
            radius_mm=best.fit.radius_mm,
            height_mm=best.height_mm,
            internal=best.sign < 0,
            arc_rad=best.lateral.arc_rad,
            rms_mm=best.fit.rms_mm,
            surface_filled=self._filled(best),
            radius_sigma_mm=best.fit.radius_sigma_mm,
            axis_sigma_rad=best.fit.axis_sigma_rad,
        )

    def _filled(self, candidate: _Candidate) -> bool:
        lateral = candidate.lateral
        return lateral.filled >= self._params.filled_min and lateral.three_finger >= self._params.three_finger_min

    def _rank(self, candidate: _Candidate) -> tuple[bool, float]:
        """Filled outer surfaces first, then by area: a bore is the answer only where it is all there is."""
        return not (candidate.sign > 0 and self._filled(candidate)), -candidate.score


def _face_set(mesh: Mesh, faces: IntArray) -> FaceSet:
    part = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[faces])
    triangles = part.triangles_mm
    return FaceSet(
        triangles_mm=triangles, centres_mm=triangles.mean(axis=1), normals=face_normals(part), areas_mm2=face_areas_mm2(part)
    )


def _candidates(mesh: Mesh, ids: IntArray, faces: FaceSet, rng: np.random.Generator) -> Iterator[_Candidate]:
    """Cylinders of both signs, each the best explanation of what the earlier ones of its sign left over."""
    origin = faces.centres_mm.mean(axis=0)
    raw = sample_surface(faces.centres_mm - origin, faces.normals, faces.areas_mm2, _SAMPLES, rng)
    if len(raw.areas_mm2) < 3:
        return
    for samples in (raw, smoothed(raw)):
        proposals = propose_cylinders(samples, rng)
        supports = support_mm2(samples, proposals)  # (h, s)
        for sign in (1.0, -1.0):
            remaining = np.where(proposals.signs[:, None] == sign, supports, 0.0)
            for _ in range(_TRIES):
                total = remaining.sum(axis=1)
                if not len(total) or total.max() <= 0.01 * samples.areas_mm2.sum():
                    break
                chosen = int(np.argmax(total))
                start = (proposals.points_mm[chosen] + origin, proposals.axes[chosen], float(proposals.radii_mm[chosen]))
                candidate = _refined(mesh, ids, faces, start, sign)
                if candidate is not None:
                    yield candidate
                remaining[:, supports[chosen] > 0] = 0.0
    start_by_curvature = cylinder_from_curvature(faces.centres_mm)
    if start_by_curvature is not None:
        towards = faces.centres_mm - start_by_curvature[0]
        sign = float(np.sign((faces.areas_mm2[:, None] * faces.normals * towards).sum()))
        candidate = _refined(mesh, ids, faces, start_by_curvature, sign)
        if candidate is not None:
            yield candidate


def _refined(mesh: Mesh, ids: IntArray, faces: FaceSet, start: Start, sign: float) -> _Candidate | None:
    """Least squares from a start, on the corners that follow it; the surface that follows the result."""
    size = float(np.ptp(faces.centres_mm, axis=0).max())
    fit = CylinderFit(point_mm=start[0], axis=start[1], radius_mm=start[2], rms_mm=0.0, radius_sigma_mm=0.0, axis_sigma_rad=0.0)
    band = min(0.02 * size, 0.1 * fit.radius_mm)
    for _ in range(2):
        near = _following(faces, fit, sign, band)
        vertices, weights = _vertices(mesh, ids[near], faces.areas_mm2[near])
        refined = _trimmed(mesh.vertices_mm[vertices], weights, fit, size)
        if refined is None:
            return None
        fit, kept = refined
        band = max(4.0 * fit.rms_mm, 0.002 * fit.radius_mm)
    facet = facet_width_rad(angles_about(mesh.vertices_mm[vertices[kept]], fit))
    tolerance = max(4.0 * fit.rms_mm, 0.001 * fit.radius_mm)
    lateral = lateral_surface(faces, fit, sign, tolerance, facet) if facet > 0 else None
    if lateral is None:
        return None
    distances = np.abs(fit.distances_mm(mesh.vertices_mm[mesh.faces[ids[near]]].reshape(-1, 3))).reshape(-1, 3).max(axis=1)
    closeness = np.log(0.02 * size / np.maximum(distances, 1e-5 * size))
    return _Candidate(fit=fit, sign=sign, lateral=lateral, score=float(faces.areas_mm2[near] @ np.maximum(closeness, 0.0)))


def _vertices(mesh: Mesh, ids: IntArray, areas: FloatArray) -> tuple[IntArray, FloatArray]:
    """True corners of the given faces (at most some thousand), each with its share of their area."""
    weights = np.bincount(mesh.faces[ids].ravel(), np.repeat(areas / 3.0, 3), len(mesh.vertices_mm))
    vertices = np.flatnonzero(weights)
    if len(vertices) > _POINTS:
        vertices = vertices[:: len(vertices) // _POINTS + 1]
    corners = corner_vertices(mesh, vertices)
    return corners, np.asarray(weights[corners], dtype=np.float64)


def _following(faces: FaceSet, fit: CylinderFit, sign: float, band_mm: float) -> BoolArray:
    """Faces near the cylinder, facing as it does. Half of their area says how much normals may tilt along the axis."""
    radial = fit.radial_mm(faces.centres_mm)
    distance = np.maximum(np.linalg.norm(radial, axis=1), 1e-300)
    outwards = (faces.normals * radial).sum(axis=1) / distance * sign
    depth = fit.radius_mm - distance
    tilt = np.abs(faces.normals @ fit.axis)
    near = (outwards > 0.5) & (depth >= -band_mm) & (depth <= band_mm + _CHORD * fit.radius_mm) & (tilt < _TILT_MAX)
    if near.any():
        near &= tilt <= 3.0 * _weighted_median(tilt[near], faces.areas_mm2[near]) + _TILT_EXACT
    return np.asarray(near)


def _trimmed(points: FloatArray, weights: FloatArray, start: CylinderFit, size_mm: float) -> tuple[CylinderFit, BoolArray] | None:
    """Least squares with the points left out that are far off for the median (by area) distance; and which were kept."""
    if not len(points):
        return None
    kept = np.ones(len(points), dtype=bool)
    fit = start
    for _ in range(_ROUNDS):
        better = fit_cylinder(points[kept], fit.point_mm, fit.axis, fit.radius_mm)
        if better is None:
            return None
        fit = better
        distance = np.abs(fit.distances_mm(points))
        limit = max(3.5 * 1.4826 * _weighted_median(distance[kept], weights[kept]), _EXACT * size_mm)
        now = distance <= limit
        if (now == kept).all():
            break
        kept = now
    return fit, kept


def _weighted_median(values: FloatArray, weights: FloatArray) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(total, total[-1] / 2.0)]])
