"""From patches of one surface each (a plane, a cylinder, …) to segments that a gripper can hold: bodies, and bores apart."""

import heapq
from dataclasses import dataclass, field

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray
from gripwright.geometry.adjacency import connected_labels
from gripwright_builtin.segmenters.energy import CONCAVE_SHARE, CONVEX_SHARE, SHARP_RAD
from gripwright_builtin.segmenters.segments import connected_parts, merged_small
from gripwright_builtin.segmenters.surface import Surface

CREASE_RAD = np.radians(35.0)
"""Surfaces that turn towards each other by more, over all that lies between them, belong to different bodies."""
CREASED_MIN = 0.85
"""Part of a border that creases make up where it divides bodies: a tooth that meets its gear's end face is part of the gear."""
NARROW = 100.0
"""A patch is narrow when its border is longer than 10 times the root of its area: a chamfer, a fillet, the edge of a sheet."""
NARROW_AREA = 0.03
"""Narrow patches up to this fraction of the surface join the neighbour that they continue."""
ENCLOSED = 0.7
"""Surfaces enclose a hollow when the sum of their area vectors is below this part of their area …"""
ONE_WAY = 0.4
"""The sum of a fillet's area vectors is above this part of its area; a bore's is not, though it may end in fillets."""
HOLLOW = 0.5
"""… they turn inwards by more than this times the root of their area (a closed bore by √(2πh/r)) …"""
OUTWARD = 0.3
"""… outwards by no more than this part of it, as ribs and bosses would, …"""
HOLLOW_AREA = 0.015
"""… and have this fraction of the surface, more than a screw hole or the gap of two teeth."""

LENGTH, INWARDS, OUTWARDS, CREASED = range(4)
"""Columns of a border: length, mm, how far it turns inwards and outwards, rad times mm, and the length of creases, mm."""


def grouped(patches: IntArray, surface: Surface, least: float = 0.005) -> IntArray:
    """Segment of each face, (m,), from the patch of one surface that each face lies on, (m,).

    Surfaces that meet in convex edges or without an edge are one body: the six faces of a box, a cylinder and its ends.
    Concave creases and concave fillets divide bodies: a plate from its bosses, a step of a shaft from the next. Surfaces
    that enclose a hollow, such as a bore, stand apart from what is around them. Patches below the fraction `least` of the
    area and narrow ones continue a neighbour. Every segment is connected.
    """
    net = _Net.of(connected_parts(patches, surface.pairs), surface)
    hollow = _hollows(net)
    large = net.without_small(least, hollow)
    ends, borders = net.borders()
    same_side = (hollow[ends[:, 0]] == hollow[ends[:, 1]]) & ((hollow[ends[:, 0]] >= 0) | ~_creased(borders))
    parts = connected_labels(ends[same_side], len(hollow))[large]
    return merged_small(connected_parts(parts, surface.pairs), surface, least)


@dataclass(slots=True, kw_only=True, eq=False)
class _Net:
    """Patches and their borders."""

    part: IntArray  # (m,) patch of each face
    areas_mm2: FloatArray  # (k,)
    area_vectors_mm2: FloatArray  # (k, 3)
    turns_mm: FloatArray  # (k, 2) how far each turns inwards and outwards itself, rad times mm
    across: list[dict[int, FloatArray]] = field(default_factory=list)  # neighbour → border

    @classmethod
    def of(cls, part: IntArray, surface: Surface) -> "_Net":
        count = int(part.max()) + 1
        ends = np.sort(part[surface.pairs], axis=1)
        apart = ends[:, 0] != ends[:, 1]
        turns = surface.angles_rad * surface.lengths_mm
        keys, inverse = np.unique(ends[apart] @ np.array([count, 1]), return_inverse=True)
        creased = np.where(surface.angles_rad < -CREASE_RAD, surface.lengths_mm, 0.0)
        columns = np.stack((surface.lengths_mm, np.maximum(-turns, 0.0), np.maximum(turns, 0.0), creased), axis=1)  # (e, 4)
        sums = _vector_sums(inverse, columns[apart], len(keys))  # (b, 4)
        net = cls(
            part=part,
            areas_mm2=_sums(part, surface.areas_mm2, count),
            area_vectors_mm2=_vector_sums(part, surface.area_vectors_mm2, count),
            turns_mm=_vector_sums(ends[~apart, 0], columns[~apart, INWARDS : OUTWARDS + 1], count),
            across=[{} for _ in range(count)],
        )
        for key, border in zip(keys.tolist(), sums, strict=True):
            p, q = divmod(key, count)
            net.across[p][q] = net.across[q][p] = border
        return net

    def borders(self) -> tuple[IntArray, FloatArray]:
        """The two patches of each border, (b, 2), and its columns, (b, 4)."""
        found = [(p, q, border) for p, around in enumerate(self.across) for q, border in around.items() if p < q]
        ends = np.array([(p, q) for p, q, _ in found], dtype=np.int64).reshape(-1, 2)
        return ends, np.array([border for _, _, border in found]).reshape(-1, 4)

    def without_small(self, least: float, hollow: IntArray) -> IntArray:
        """Join small and narrow patches, the smallest first, to the neighbour that they continue; each face's patch then.

        A neighbour in the same hollow (k,), or outside like the patch, comes first.
        """
        total = self.areas_mm2.sum()
        outline = np.array([sum(border[LENGTH] for border in around.values()) for around in self.across])
        narrow = (outline**2 > NARROW * self.areas_mm2) & (self.areas_mm2 < NARROW_AREA * total)
        small = (self.areas_mm2 < least * total) | narrow | self._blends(outline)
        into = np.arange(len(self.areas_mm2))
        waiting = [(float(self.areas_mm2[p]), int(p)) for p in np.flatnonzero(small)]
        heapq.heapify(waiting)
        while waiting:
            area, p = heapq.heappop(waiting)
            if area != self.areas_mm2[p] or into[p] != p or not self.across[p]:
                continue  # it has grown or joined another meanwhile, or fills its surroundings
            q = max(self.across[p], key=lambda i: (hollow[i] == hollow[p], _continuity(self.across[p][i]), -i))
            if small[q]:  # what two small ones become may turn; a large one keeps its own form
                self.turns_mm[q] += self.turns_mm[p] + self.across[p][q][[INWARDS, OUTWARDS]]
            self._join(p, q)
            into[p] = q
            if small[q]:
                heapq.heappush(waiting, (float(self.areas_mm2[q]), q))
        while (into[into] != into).any():
            into = into[into]
        return np.asarray(into[self.part])

    def _blends(self, outline: FloatArray) -> BoolArray:
        """Patches that lead from one surface to another without an edge, curving inwards and mostly one way: fillets, (k,)."""
        smooth = np.array(
            [
                sum(
                    border[LENGTH]
                    for border in around.values()
                    if border[INWARDS] + border[OUTWARDS] < CREASE_RAD * border[LENGTH]
                )
                for around in self.across
            ]
        )
        inwards = self.turns_mm[:, 0] - self.turns_mm[:, 1] > HOLLOW * np.sqrt(self.areas_mm2)
        one_way = np.linalg.norm(self.area_vectors_mm2, axis=1) > ONE_WAY * self.areas_mm2
        return np.asarray(inwards & one_way & (smooth > CREASED_MIN * outline))

    def _join(self, p: int, q: int) -> None:
        """Patch p becomes part of q; what lies beyond p is then as far round as p and its border with q turn."""
        others = {r: border for r, border in self.across[p].items() if r != q}
        between = self.across[p][q]
        length = (between[LENGTH] + sum(border[LENGTH] for border in others.values())) / 2.0
        inwards, outwards = between[[INWARDS, OUTWARDS]] / between[LENGTH] + self.turns_mm[p] / length  # rad
        for r, border in others.items():
            del self.across[r][p]
            known = self.across[q].get(r)
            if known is None:
                joint = border + border[LENGTH] * np.array([0.0, inwards, outwards, 0.0])
                if joint[INWARDS] > CREASE_RAD * joint[LENGTH]:
                    joint[CREASED] = joint[LENGTH]
            else:  # p lies beside that border, not in between
                joint = known + border
            self.across[q][r] = self.across[r][q] = joint
        del self.across[q][p]
        self.across[p] = {}
        for values in (self.areas_mm2, self.area_vectors_mm2):
            values[q] += values[p]
            values[p] = 0.0


def _continuity(border: FloatArray) -> float:
    """Length of a border, less of it where it turns."""
    inwards, outwards = np.minimum(border[[INWARDS, OUTWARDS]] / border[LENGTH] / SHARP_RAD, 1.0)
    return float(border[LENGTH] * (1.0 - inwards * (1.0 - CONCAVE_SHARE)) * (1.0 - outwards * (1.0 - CONVEX_SHARE)))


def _creased(borders: FloatArray) -> BoolArray:
    """Which borders divide bodies, (b,)."""
    return np.asarray(borders[:, CREASED] > CREASED_MIN * borders[:, LENGTH])


def _hollows(net: _Net) -> IntArray:
    """Number of the hollow that each patch helps to enclose, (k,), −1: none.

    Patches meet there in creases or without an edge; those that curve outwards, such as bosses, are no part of it.
    """
    ends, borders = net.borders()
    count = len(net.areas_mm2)
    scale = np.sqrt(net.areas_mm2)
    bulging = net.turns_mm[:, 1] - net.turns_mm[:, 0] > HOLLOW * scale
    smooth = borders[:, INWARDS] + borders[:, OUTWARDS] < CREASE_RAD * borders[:, LENGTH]
    linked = (_creased(borders) | smooth) & ~bulging[ends].any(axis=1)
    group = connected_labels(ends[linked], count)
    inner = group[ends[:, 0]] == group[ends[:, 1]]

    def summed(of_patch: FloatArray, of_border: FloatArray) -> FloatArray:
        return _sums(group, of_patch, count) + _sums(group[ends[inner, 0]], of_border[inner], count)

    inwards = summed(net.turns_mm[:, 0], borders[:, INWARDS])
    outwards = summed(net.turns_mm[:, 1], borders[:, OUTWARDS])
    area, vectors = _sums(group, net.areas_mm2, count), _vector_sums(group, net.area_vectors_mm2, count)
    hollow = (
        (np.linalg.norm(vectors, axis=1) < ENCLOSED * area) & (inwards > HOLLOW * np.sqrt(area)) & (outwards < OUTWARD * inwards)
    )
    hollow &= area > HOLLOW_AREA * area.sum()
    return np.where(hollow[group], group, -1)


def _sums(group: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Sum of the values (n,) of each of `count` groups."""
    return np.bincount(group, values, count).astype(np.float64)


def _vector_sums(group: IntArray, vectors: FloatArray, count: int) -> FloatArray:
    """Sum of the vectors (n, c) of each of `count` groups, (count, c)."""
    return np.stack([_sums(group, column, count) for column in vectors.T], axis=1)
