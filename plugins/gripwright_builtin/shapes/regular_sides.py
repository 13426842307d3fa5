"""Flat sides that stand evenly about an axis and are tilted alike: those of regular prisms and pyramids. Lengths in mm."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.facets import Facet, facets
from gripwright.geometry.frames import any_perpendicular

_FACET_RAD = float(np.radians(10.0))  # within which normals belong to one side
_LARGEST = 16  # facets that propose an axis
_AXES = 60  # proposals looked at
_TILT = 0.05  # by which a side's normal along the axis may differ
_EVEN = 0.95  # coherence of the sides' angles about the axis
_ACROSS = float(np.cos(np.radians(3.0)))
_END = 0.01  # of the inradius: so near to an end its face lies
_POINTED = 0.01  # of the inradius at the wide end


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RegularSides:
    """`sides` planes about an axis, in the component's frame; along `axis_C` they come closer to it by the half angle."""

    sides: int
    center_C: FloatArray  # (3,) midpoint of the axis
    axis_C: FloatArray  # (3,) unit
    side_C: FloatArray  # (3,) unit, across the axis, towards the middle of the first side
    half_angle_rad: float  # between axis and sides, 0..π/2
    inradius_mm: float  # distance of the sides from the axis at the wide end
    inradius_top_mm: float  # at the narrow end, 0: they meet in an apex
    height_mm: float
    internal: bool  # True: a socket
    filled: FloatArray  # (sides,) share of each side that is covered by surface, 0..1
    ends_filled: FloatArray  # (2,) of the wide and the narrow end
    rms_mm: float  # of the surface's corners from their side
    share: float  # of the segment's area that the sides make up, 0..1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Planes:
    """All facets of a segment."""

    mesh: Mesh
    facets: Sequence[Facet]
    normals: FloatArray  # (g, 3)
    offsets_mm: FloatArray  # (g,) from `origin_C`
    areas_mm2: FloatArray  # (g,)
    origin_C: FloatArray  # (3,)


def regular_sides(mesh: Mesh, faces: IntArray, half_angles_rad: tuple[float, float], sides_max: int) -> Iterator[RegularSides]:
    """The sets of 3..`sides_max` regular sides whose half angle is within the closed range, the largest first."""
    found = facets(mesh, faces, _FACET_RAD)
    if len(found) < 3:
        return
    used = np.unique(mesh.faces[faces])
    origin = (mesh.vertices_mm[used].min(axis=0) + mesh.vertices_mm[used].max(axis=0)) / 2.0
    normals = np.array([facet.normal for facet in found])
    planes = _Planes(
        mesh=mesh,
        facets=found,
        normals=normals,
        offsets_mm=np.array([facet.offset_mm for facet in found]) - normals @ origin,
        areas_mm2=np.array([facet.area_mm2 for facet in found]),
        origin_C=origin,
    )
    for group in _groups(planes, half_angles_rad):
        sides = _sides(planes, group, half_angles_rad, sides_max)
        if sides is not None:
            yield sides


def _groups(planes: _Planes, half_angles_rad: tuple[float, float]) -> list[BoolArray]:
    """Facets that are tilted alike against an axis that three of them name, (g,) each; the largest area first."""
    triples = np.array(list(combinations(range(min(len(planes.facets), _LARGEST)), 3)))
    n = planes.normals[triples]  # (t, 3, 3)
    axes = np.cross(n[:, 0] - n[:, 1], n[:, 0] - n[:, 2])
    length = np.linalg.norm(axes, axis=1)
    axes = axes[length > 0.01] / length[length > 0.01, None]
    tilt = (n[length > 0.01, 0] * axes).sum(axis=1)  # (t,) sine of the half angle
    within = (np.abs(tilt) >= np.sin(half_angles_rad[0]) - _TILT) & (np.abs(tilt) <= np.sin(half_angles_rad[1]) + _TILT)
    alike = np.abs(axes[within] @ planes.normals.T - tilt[within, None]) <= _TILT  # (t, g)
    distinct = np.unique(alike, axis=0)
    area = distinct @ planes.areas_mm2
    return [distinct[k] for k in np.argsort(-area, kind="stable")[:_AXES]]


def _sides(planes: _Planes, group: BoolArray, half_angles_rad: tuple[float, float], sides_max: int) -> RegularSides | None:
    """What the facets of a group make up; None where they are not regular."""
    n, areas = planes.normals[group], planes.areas_mm2[group]
    mean = areas @ n / areas.sum()
    axis = np.linalg.eigh(((n - mean) * areas[:, None]).T @ (n - mean))[1][:, 0]  # along it all are tilted alike
    tilt = float(mean @ axis)
    cosine = np.sqrt(max(1.0 - tilt**2, 1e-12))
    x = any_perpendicular(axis)
    y = np.cross(axis, x)
    angles = np.arctan2(n @ y, n @ x)
    even = _evenly(angles, areas, sides_max)
    if even is None:
        return None
    sides, phase = even
    slot = np.rint((angles - phase) / (2.0 * np.pi / sides)).astype(np.int64) % sides
    turns = phase + 2.0 * np.pi / sides * np.arange(sides)
    towards = np.cos(turns)[:, None] * x + np.sin(turns)[:, None] * y  # (sides, 3)
    u, root = towards[slot], np.sqrt(areas)
    left = np.column_stack([u @ x, u @ y, np.ones(len(u))]) * root[:, None]
    place_x, place_y, inradius = np.linalg.lstsq(left, root * planes.offsets_mm[group] / cosine, rcond=None)[0]
    point, slope = planes.origin_C + place_x * x + place_y * y, tilt / cosine
    internal = bool(inradius < 0.0)
    if internal:
        towards, inradius, slope = -towards, -inradius, -slope
    if slope < 0.0:
        axis, slope = -axis, -slope
    if not half_angles_rad[0] <= np.arctan(slope) <= half_angles_rad[1]:
        return None
    form = _Form(
        point_C=point, axis_C=axis, towards_C=towards, inradius_mm=float(inradius), slope=float(slope), internal=internal
    )
    return _measured(planes, group, slot, form)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Form:
    """Endless regular sides."""

    point_C: FloatArray  # (3,) on the axis
    axis_C: FloatArray  # (3,)
    towards_C: FloatArray  # (sides, 3) from the axis
    inradius_mm: float  # at the point
    slope: float  # by which it shrinks along the axis
    internal: bool

    @property
    def normals(self) -> FloatArray:
        """Unit normals of the planes, away from the axis, (sides, 3)."""
        return np.asarray((self.towards_C + self.slope * self.axis_C) / np.hypot(1.0, self.slope))


def _evenly(angles: FloatArray, areas: FloatArray, sides_max: int) -> tuple[int, float] | None:
    """How many sides stand evenly about the axis, and the angle of the first; None where they do not."""
    for sides in range(3, sides_max + 1):
        phasor = areas @ np.exp(1j * sides * angles) / areas.sum()
        phase = float(np.angle(phasor)) / sides
        slot = np.rint((angles - phase) / (2.0 * np.pi / sides)).astype(np.int64) % sides
        if abs(phasor) >= _EVEN and len(np.unique(slot)) == sides:
            return sides, phase
    return None


def _measured(planes: _Planes, group: BoolArray, slot: IntArray, form: _Form) -> RegularSides | None:
    """The extent of endless sides, and how much of them is there."""
    chosen = [planes.facets[k] for k in np.flatnonzero(group).tolist()]
    corners = planes.mesh.vertices_mm[planes.mesh.faces[np.concatenate([facet.faces for facet in chosen])]] - form.point_C
    along = corners @ form.axis_C  # (m, 3)
    low, high = float(along.min()), float(along.max())
    wide, narrow = (max(form.inradius_mm - form.slope * at, 0.0) for at in (low, high))
    if narrow <= _POINTED * wide:
        narrow, high = 0.0, form.inradius_mm / form.slope
    if high - low <= 0.0 or wide <= 0.0:
        return None
    sides, normals = len(form.towards_C), form.normals
    owner = np.repeat(slot, [len(facet.faces) for facet in chosen])  # (m,)
    off = np.einsum("mij,mj->mi", corners, normals[owner]) - form.inradius_mm / np.hypot(1.0, form.slope)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rms = np.sqrt(np.average((off**2).mean(axis=1), weights=np.linalg.norm(cross, axis=1)))
    whole = np.tan(np.pi / sides) * (wide + narrow) * (high - low) * np.hypot(1.0, form.slope)
    areas = planes.areas_mm2[group]
    return RegularSides(
        sides=sides,
        center_C=form.point_C + form.axis_C * (low + high) / 2.0,
        axis_C=form.axis_C,
        side_C=form.towards_C[0],
        half_angle_rad=float(np.arctan(form.slope)),
        inradius_mm=float(wide),
        inradius_top_mm=float(narrow),
        height_mm=high - low,
        internal=form.internal,
        filled=np.minimum(np.bincount(slot, areas, sides) / whole, 1.0),
        ends_filled=np.array([_end_filled(planes, form, at, r, sides) for at, r in ((low, wide), (high, narrow))]),
        rms_mm=float(rms),
        share=float(areas.sum() / planes.areas_mm2.sum()),
    )


def _end_filled(planes: _Planes, form: _Form, at_mm: float, inradius_mm: float, sides: int) -> float:
    """Share of the end at that place along the axis which faces away from the middle and is covered, 0..1."""
    whole = sides * np.tan(np.pi / sides) * inradius_mm**2
    middle = planes.origin_C - form.point_C
    outward = form.axis_C * np.sign(at_mm - middle @ form.axis_C)
    point = form.point_C + form.axis_C * at_mm
    offsets = planes.offsets_mm - (point - planes.origin_C) @ outward
    on = (planes.normals @ outward >= _ACROSS) & (np.abs(offsets) <= _END * inradius_mm)
    return min(float(planes.areas_mm2[on].sum()) / whole, 1.0) if whole > 0.0 else 0.0
