"""What kind of assembly operation it is: from the end of its motion and from what the component meets there.

Surfaces are compared at points sampled evenly where the two sides come near each other, each against the tangent plane of
the other side's nearest point: so a coarse tessellation is judged like a fine one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from gripwright.domain.affordance import Forbidden
from gripwright.domain.shape import BoolArray, FloatArray, Mesh
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.measures import face_cross_mm2

PEG_IN_HOLE = "peg-in-hole"
PLACING = "placing"
SCREWING = "screwing"
PRESS_FIT = "press-fit"
MESHING = "meshing"
UNKNOWN = "unknown"

DEFAULT_FORCE_N: Mapping[str, float] = MappingProxyType(
    {PLACING: 0.0, PEG_IN_HOLE: 10.0, SCREWING: 10.0, MESHING: 10.0, PRESS_FIT: 100.0, UNKNOWN: 0.0}
)
"""Insertion force where the package states none: rules of thumb for parts that a robot of some kg holds, not measurements."""

_NEAR_MM = 0.6  # gap up to which surfaces count as meeting: a loose fit and the chords of a tessellation
_PRESSED_MM = 0.02  # median overlap from which a fit is a press fit, unless it is said to be a clearance fit
_POINTS = 6000  # samples a side
_AGAINST = -0.85  # cosine between the normals of surfaces that meet
_SIDE, _SEAT = 0.3, 0.9  # |cosine| of a normal with the motion: below, above
_ENCLOSED_RAD = np.radians(170.0)  # widest gap between the directions of side contact that still leaves no way out
_TURN_RAD = np.radians(20.0)
_PITCH_MM = 0.05  # advance in a turn


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedComponent:
    """A component at its place in the product. `forbidden` (gear teeth, threads) refers to the faces of `mesh`."""

    id: str
    mesh: Mesh
    X_PC: FloatArray  # (4, 4)
    forbidden: tuple[Forbidden, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OperationClass:
    """The kind of an operation; `axis_P` is a point of the insertion axis and the direction of motion, product frame."""

    kind: str
    axis_P: FloatArray | None  # (2, 3)
    evidence: dict[str, Any]  # JSON: mm, degrees

    @property
    def default_force_N(self) -> float:
        """Insertion force to reckon with where the package states none."""
        return DEFAULT_FORCE_N[self.kind]


def classify(
    motion: FloatArray, fit: str | None, active: Sequence[PlacedComponent], passive: Sequence[PlacedComponent]
) -> OperationClass:
    """The kind of an operation whose `motion` (k, 4, 4) displaces the active components from their places."""
    end = motion[-1]
    moved = [PlacedComponent(id=one.id, mesh=one.mesh, X_PC=end @ one.X_PC, forbidden=one.forbidden) for one in active]
    twist = _final_twist(motion)
    centre = np.mean([transform(one.X_PC, one.mesh.vertices_mm).mean(axis=0) for one in moved], axis=0)
    direction = _final_direction(motion, centre)
    if twist is not None:
        point, axis, turn, advance = twist
        evidence = {"turn": float(np.degrees(turn)), "pitch": float(abs(advance) / turn * 2.0 * np.pi)}
        return OperationClass(kind=SCREWING, axis_P=np.stack([point, axis * np.sign(advance)]), evidence=evidence)
    if direction is None:
        return OperationClass(kind=UNKNOWN, axis_P=None, evidence={"motion": "none at the end"})
    if not passive:
        return OperationClass(kind=PLACING, axis_P=np.stack([centre, direction]), evidence={"meets": "nothing"})
    near = beside(motion, active, passive)
    for kind, mark in ((SCREWING, "starts"), (MESHING, "tip_diameter")):
        found = _marked_contact(moved, near, mark, kind)
        if found is not None:
            return OperationClass(kind=kind, axis_P=np.stack([found[0], direction]), evidence=found[1])
    return _by_contact(_contact(moved, near) if near else None, centre, direction, fit)


def beside(motion: FloatArray, active: Sequence[PlacedComponent], passive: Sequence[PlacedComponent]) -> list[PlacedComponent]:
    """The passive components that the active ones can meet at the end of the motion: the others have no say in the kind."""
    pitches = [float(region.evidence.get("pitch", 0.0)) for one in active for region in one.forbidden]
    reach = max(_NEAR_MM, *(0.5 * pitch for pitch in pitches)) if pitches else _NEAR_MM
    moved = np.array([_extent(one, motion[-1]) for one in active])  # (a, 2, 3)
    low, high = moved[:, 0].min(axis=0) - reach, moved[:, 1].max(axis=0) + reach
    extents = [_extent(one, np.eye(4)) for one in passive]
    return [one for one, (a, b) in zip(passive, extents, strict=True) if (b >= low).all() and (a <= high).all()]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Contact:
    """Points of the active surface that meet the passive one: normals outward, gaps negative where they overlap."""

    points_P: FloatArray  # (k, 3)
    normals_P: FloatArray  # (k, 3)
    gaps_mm: FloatArray  # (k,)
    area_mm2: float  # of one point


def _by_contact(contact: _Contact | None, centre: FloatArray, direction: FloatArray, fit: str | None) -> OperationClass:
    """Peg-in-hole where the contact surrounds the motion, press fit where it overlaps, placing where it faces the motion."""
    if contact is None:
        kind = PRESS_FIT if fit == "press" else UNKNOWN
        return OperationClass(kind=kind, axis_P=np.stack([centre, direction]), evidence={"fit": fit, "meets": "nothing"})
    along = contact.normals_P @ direction
    side, seat = np.abs(along) < _SIDE, along > _SEAT
    evidence: dict[str, Any] = {
        "side_area": float(side.sum() * contact.area_mm2),
        "seat_area": float(seat.sum() * contact.area_mm2),
        "fit": fit,
    }
    enclosed = _widest_gap_rad(contact.normals_P[side], direction) < _ENCLOSED_RAD
    point = centre
    overlap_mm = 0.0
    if enclosed:
        point, radius = _axis(contact.points_P[side], contact.normals_P[side], direction)
        overlap_mm = -float(np.median(contact.gaps_mm[side]))
        depth = float(np.ptp(contact.points_P[side] @ direction))
        evidence |= {"radius": radius, "depth": depth, "overlap": overlap_mm}
    if fit == "press" or (enclosed and fit is None and overlap_mm > _PRESSED_MM):
        kind = PRESS_FIT
    elif enclosed:
        kind = PEG_IN_HOLE
    else:
        kind = PLACING if seat.any() else UNKNOWN
    return OperationClass(kind=kind, axis_P=np.stack([point, direction]), evidence=evidence)


def _final_twist(motion: FloatArray) -> tuple[FloatArray, FloatArray, float, float] | None:
    """Point, direction, angle and advance of the screw motion of the last step that moves; None where it does not screw."""
    for start, end in zip(motion[-2::-1], motion[:0:-1], strict=True):
        move = end @ inverse(start)
        turn = Rotation.from_matrix(move[:3, :3]).as_rotvec()
        angle = float(np.linalg.norm(turn))
        if angle < 1e-7 and np.linalg.norm(move[:3, 3]) < 1e-9:
            continue
        if angle < _TURN_RAD:
            return None
        axis = turn / angle
        advance = float(move[:3, 3] @ axis)
        if abs(advance) * 2.0 * np.pi / angle < _PITCH_MM:
            return None
        across = move[:3, 3] - axis * advance
        point = np.linalg.lstsq(np.eye(3) - move[:3, :3], across, rcond=None)[0]
        return point, axis, angle, advance
    return None


def _final_direction(motion: FloatArray, centre_P: FloatArray) -> FloatArray | None:
    """Direction in which the active subassembly's centre (at the motion's end) comes to its end."""
    home = inverse(motion[-1]) @ np.append(centre_P, 1.0)
    ways = centre_P - (motion[:-1] @ home)[:, :3]
    lengths = np.linalg.norm(ways, axis=1)
    moved = np.flatnonzero(lengths > 1e-6)
    return np.asarray(ways[moved[-1]] / lengths[moved[-1]]) if len(moved) else None


def _marked_contact(
    active: Sequence[PlacedComponent], passive: Sequence[PlacedComponent], mark: str, kind: str
) -> tuple[FloatArray, dict[str, Any]] | None:
    """Where surface of one mark (threads have `starts`, gear teeth a `tip_diameter`) comes within half a pitch of the same."""
    for one in active:
        for region in one.forbidden:
            for other in passive:
                for opposite in other.forbidden:
                    if mark not in region.evidence or mark not in opposite.evidence:
                        continue
                    reach_mm = 0.5 * float(region.evidence["pitch"])
                    here, there = _corners(one, region.faces), _corners(other, opposite.faces)
                    near = np.isfinite(cKDTree(there).query(here, distance_upper_bound=reach_mm)[0])
                    if near.any():
                        evidence = {"component": one.id, "with": other.id, "marks": [region.reason, opposite.reason]}
                        return _mark_centre(one, region, here), evidence
    return None


def _mark_centre(one: PlacedComponent, region: Forbidden, corners: FloatArray) -> FloatArray:
    point = region.evidence.get("point")
    return corners.mean(axis=0) if point is None else transform(one.X_PC, np.asarray(point, dtype=np.float64))


def _corners(one: PlacedComponent, faces: BoolArray) -> FloatArray:
    triangles = one.mesh.vertices_mm[one.mesh.faces[faces]]
    return transform(one.X_PC, np.concatenate([triangles.reshape(-1, 3), triangles.mean(axis=1)]))


def _contact(active: Sequence[PlacedComponent], passive: Sequence[PlacedComponent]) -> _Contact | None:
    """Where the active surface meets the passive one; None where it does not."""
    here, there = _soup(active), _soup(passive)
    low = np.maximum(here.min(axis=(0, 1)), there.min(axis=(0, 1))) - _NEAR_MM
    high = np.minimum(here.max(axis=(0, 1)), there.max(axis=(0, 1))) + _NEAR_MM
    rng = np.random.default_rng(0)
    points, normals, area = _samples(here, low, high, rng)
    others, other_normals, other_area = _samples(there, low, high, rng)
    if not len(points) or not len(others):
        return None
    beside = 2.0 * float(np.sqrt(other_area))  # how far the nearest sample may lie along the surface
    distance, index = cKDTree(others).query(points, k=8, distance_upper_bound=float(np.hypot(_NEAR_MM, beside)))
    index = np.minimum(index, len(others) - 1)
    offset = points[:, None] - others[index]  # (k, 8, 3)
    gap = np.einsum("kjc,kjc->kj", offset, other_normals[index])
    meets = (
        np.isfinite(distance) & (np.abs(gap) <= _NEAR_MM) & (np.einsum("kc,kjc->kj", normals, other_normals[index]) <= _AGAINST)
    )
    found = meets.any(axis=1)
    if not found.any():
        return None
    first = np.argmax(meets, axis=1)[found]
    return _Contact(points_P=points[found], normals_P=normals[found], gaps_mm=gap[found, first], area_mm2=area)


def _soup(components: Sequence[PlacedComponent]) -> FloatArray:
    return np.concatenate([np.empty((0, 3, 3)), *(transform(one.X_PC, one.mesh.triangles_mm) for one in components)])


def _extent(one: PlacedComponent, X: FloatArray) -> FloatArray:
    """Lower and upper corner of its bounding box when displaced by X, (2, 3)."""
    points = transform(X @ one.X_PC, one.mesh.vertices_mm)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _samples(
    triangles: FloatArray, low: FloatArray, high: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, float]:
    """Even samples of the surface inside the box: points, outward normals, and the area that one stands for."""
    near = ((triangles.max(axis=1) >= low) & (triangles.min(axis=1) <= high)).all(axis=1)
    soup = triangles[near].reshape(-1, 3)
    mesh = Mesh(vertices_mm=soup, faces=np.arange(len(soup), dtype=np.int64).reshape(-1, 3))
    cross = face_cross_mm2(mesh)
    twice = np.linalg.norm(cross, axis=1)
    total = float(twice.sum()) / 2.0
    if total <= 0.0:
        return np.empty((0, 3)), np.empty((0, 3)), 0.0
    chosen = np.searchsorted(np.cumsum(twice) / twice.sum(), (np.arange(_POINTS) + 0.5) / _POINTS)
    u, v = rng.random((2, _POINTS))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = np.moveaxis(triangles[near][chosen], 1, 0)
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    inside = ((points >= low) & (points <= high)).all(axis=1)
    return points[inside], (cross[chosen] / twice[chosen, None])[inside], total / _POINTS


def _widest_gap_rad(normals: FloatArray, direction: FloatArray) -> float:
    """Widest angle about the motion without side contact; a full turn where there is none."""
    if len(normals) < 3:
        return float(2.0 * np.pi)
    x = np.linalg.svd(direction[None])[2][1]
    angles = np.sort(np.arctan2(normals @ np.cross(direction, x), normals @ x))
    return float(max(np.diff(angles).max(), angles[0] + 2.0 * np.pi - angles[-1]))


def _axis(points: FloatArray, normals: FloatArray, direction: FloatArray) -> tuple[FloatArray, float]:
    """The point nearest to all lines along the normals, level with the contact's middle, and its mean distance from them."""
    across = np.cross(direction, normals)  # a line's points p have across · p = across · point
    rows = np.vstack([across, direction])
    sides = np.append(np.einsum("kc,kc->k", across, points), direction @ points.mean(axis=0))
    centre = np.linalg.lstsq(rows, sides, rcond=None)[0]
    radial = points - centre
    radial -= np.outer(radial @ direction, direction)
    return centre, float(np.linalg.norm(radial, axis=1).mean())
