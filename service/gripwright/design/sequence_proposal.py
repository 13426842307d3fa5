"""An assembly sequence proposed from the finished product: by taking it apart (Homem de Mello and Sanderson, 1991).

One component after another is taken out along a straight line; backwards that is the assembly. Threads that are modelled
and parts that must be turned or moved together cannot be taken out so.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gripwright.design.overlap import deepest_overlap
from gripwright.design.scenes import Body
from gripwright.domain.assembly import Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.frames import any_perpendicular, transform
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm
from gripwright.geometry.rays import RayScene
from gripwright.geometry.refine import refine

CLEAR_MM = 20.0
"""How far apart component and product are, along the motion, before and after it."""
_POINTS = 4000  # of a component's surface, spread evenly over it
_PARALLEL = 0.999


def propose_sequence(bodies: Sequence[Body], tolerance_mm: float) -> tuple[Operation, ...] | Rejection:
    """Operations that put the components together one by one, each along one straight line.

    Contact and overlap up to `tolerance_mm` do not stop a motion, nor does as much overlap as there is in the finished
    product (modelled so: threads without threads, press fits). The largest component comes first and is set down,
    small ones come late.
    """
    parts = [_part(body) for body in bodies]
    base = max(range(len(parts)), key=lambda k: (parts[k].size_mm3, -k))
    left, taken = set(range(len(parts))), []
    blockers = _Blockers(parts, tolerance_mm)
    while len(left) > 1:
        free = [(k, d) for k in sorted(left - {base}) for d in range(len(parts[k].directions)) if not blockers.of(k, d) & left]
        if not free:
            stuck = ", ".join(repr(parts[k].id) for k in sorted(left - {base}))
            return Rejection(
                "no-sequence", f"no straight motion takes out any of {stuck}; {_example(parts, left, base, blockers)}"
            )
        k, d = min(free, key=lambda choice: parts[choice[0]].preference(choice[1]))
        left.remove(k)
        taken.append((k, parts[k].directions[d], tuple(sorted(left))))
    taken.append((base, np.array([0.0, 0.0, 1.0]), ()))
    digits = max(2, len(str(len(taken))))
    return tuple(
        Operation(
            id=f"op-{number + 1:0{digits}d}",
            active=(parts[k].id,),
            passive=tuple(parts[i].id for i in rest),
            motion=np.stack([_shift(direction * parts[k].way_mm(direction, [parts[i] for i in rest])), np.eye(4)]),
        )
        for number, (k, direction, rest) in enumerate(reversed(taken))
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Part:
    """A component in its place: the product frame."""

    body: Body
    vertices_mm: FloatArray  # (n, 3)
    points_mm: FloatArray  # (k, 3) of its surface
    scene: RayScene
    directions: tuple[FloatArray, ...]  # unit, along which it may be taken out

    @property
    def id(self) -> str:
        """Of the component."""
        return self.body.component.id

    @property
    def size_mm3(self) -> float:
        """Volume of the bounding box."""
        return float(np.prod(np.ptp(self.vertices_mm, axis=0)))

    def preference(self, direction: int) -> tuple[float, float, str]:
        """Sorts what to take out next: the smallest part (fasteners hold the others), upwards, else sideways, else downwards."""
        return round(self.size_mm3, 3), -round(float(self.directions[direction][2]), 3), self.id

    def way_mm(self, direction: FloatArray, rest: Sequence["_Part"]) -> float:
        """How far along the direction it is clear of the others."""
        ahead = max((float((part.vertices_mm @ direction).max()) for part in rest), default=-np.inf)
        return max(ahead - float((self.vertices_mm @ direction).min()), 0.0) + CLEAR_MM


class _Blockers:
    """Which parts stand in the way of a part in each of its directions, found when asked for."""

    def __init__(self, parts: Sequence[_Part], tolerance_mm: float) -> None:
        self._parts, self._tolerance_mm = parts, tolerance_mm
        self._known: dict[tuple[int, int], frozenset[int]] = {}
        self._overlaps_mm: dict[tuple[int, int], float] = {}

    def of(self, moved: int, direction: int) -> frozenset[int]:
        """Indices of the parts that a part meets along a direction (its index)."""
        if (moved, direction) not in self._known:
            line = self._parts[moved].directions[direction]
            others = (k for k in range(len(self._parts)) if k != moved)
            self._known[moved, direction] = frozenset(k for k in others if self._stops(moved, k, line))
        return self._known[moved, direction]

    def _stops(self, moved: int, fixed: int, direction: FloatArray) -> bool:
        one, other = self._parts[moved], self._parts[fixed]
        if not _meets(one, other, direction, self._tolerance_mm):
            return False
        overlap_mm = self._overlap_mm(moved, fixed)
        return overlap_mm == 0.0 or _meets(one, other, direction, self._tolerance_mm + overlap_mm)

    def _overlap_mm(self, moved: int, fixed: int) -> float:
        """Depth of the overlap of two parts in the finished product."""
        pair = (min(moved, fixed), max(moved, fixed))
        if pair not in self._overlaps_mm:
            one, other = self._parts[pair[0]].body, self._parts[pair[1]].body
            found = [deepest_overlap(np.eye(4)[None], [a], [b]) for a, b in ((one, other), (other, one))]
            self._overlaps_mm[pair] = max((item.depth_mm for item in found if item is not None), default=0.0)
        return self._overlaps_mm[pair]


def _part(body: Body) -> _Part:
    X_PC, solid = body.component.X_PC, body.solid
    vertices = transform(X_PC, solid.vertices_mm)
    axes = [sign * axis for axis in (*np.eye(3)[::-1], *X_PC[:3, :3].T) for sign in (1.0, -1.0)]
    directions: list[FloatArray] = []
    for axis in axes:
        if all(axis @ known < _PARALLEL for known in directions):
            directions.append(axis)
    return _Part(
        body=body,
        vertices_mm=vertices,
        points_mm=transform(X_PC, _even_points(solid)),
        scene=RayScene(vertices, solid.faces),
        directions=tuple(directions),
    )


def _even_points(solid: Mesh) -> FloatArray:
    """Points of a surface, as many on equal areas, (≤ _POINTS, 3)."""
    fine = refine(solid, float(np.sqrt(face_areas_mm2(solid).sum() / _POINTS)))
    covered = np.cumsum(face_areas_mm2(fine))
    chosen = np.unique(np.searchsorted(covered, np.linspace(0.0, covered[-1], _POINTS + 1)[:-1]))
    return face_centres_mm(fine)[chosen]


def _meets(moved: _Part, fixed: _Part, direction: FloatArray, tolerance_mm: float) -> bool:
    """Whether a part runs into another on its way out, over more than the tolerance on all sides."""
    side = any_perpendicular(direction)
    across = np.stack([side, np.cross(direction, side)])  # (2, 3)
    a, b = moved.vertices_mm @ across.T, fixed.vertices_mm @ across.T
    if (a.max(axis=0) < b.min(axis=0)).any() or (b.max(axis=0) < a.min(axis=0)).any():
        return False
    if (fixed.vertices_mm @ direction).max() < (moved.vertices_mm @ direction).min():
        return False
    around = tolerance_mm * np.concatenate([across, -across])
    return _enters(moved.points_mm, direction, around, fixed.scene) or _enters(fixed.points_mm, -direction, around, moved.scene)


def _enters(points_mm: FloatArray, direction: FloatArray, around_mm: FloatArray, scene: RayScene) -> bool:
    """Whether from any of the points (k, 3) all rays, shifted by `around_mm` (4, 3), run into a mesh from outside."""
    left = points_mm
    for shift in (np.zeros(3), *around_mm):
        directions = np.ascontiguousarray(np.broadcast_to(direction, left.shape), dtype=np.float32)
        _, face, normal = scene.first_hits(scene.centred(left + shift), directions)
        left = left[(face >= 0) & (np.einsum("ij,ij->i", normal, directions) < 0)]
        if not len(left):
            return False
    return True


def _example(parts: Sequence[_Part], left: set[int], base: int, blockers: _Blockers) -> str:
    """What stops the first of the parts that are stuck, upwards."""
    k = min(left - {base})
    names = ", ".join(repr(parts[i].id) for i in sorted(blockers.of(k, 0) & left))
    return f"upwards {parts[k].id!r} runs into {names}"


def _shift(vector_mm: FloatArray) -> FloatArray:
    X = np.eye(4)
    X[:3, 3] = vector_mm
    return X
