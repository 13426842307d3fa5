"""From labels of faces to segments: connected, not too small, not too ragged, measured."""

import heapq

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.adjacency import connected_labels
from gripwright.geometry.measures import face_areas_mm2
from gripwright_builtin.segmenters.surface import Surface

RAGGED = 100.0
"""A part whose border is longer than 10 times the root of its area is a strip, such as the flank of a thread: no segment."""
CREASE_RAD = np.radians(30.0)
"""Surface that turns inwards by more divides: a countersunk head (41°) from its shank."""
EDGE_RAD = np.radians(40.0)
"""Edges that turn less may be those of facets of a round surface, such as a bore."""
HOLLOW = 0.5
"""A patch is hollow when its mean curvature times the root of its area is below minus this (a closed bore is at −√(2πh/r)) …"""
ROUND = 0.3
"""… and its faces look all ways: the sum of their area vectors is below this part of their area."""


def connected_parts(labels: IntArray, pairs: IntArray) -> IntArray:
    """Number of each face's connected set of equally labelled faces, (m,)."""
    return connected_labels(pairs[labels[pairs[:, 0]] == labels[pairs[:, 1]]], len(labels))


def divided_at_creases(parts: IntArray, surface: Surface, least: float) -> IntArray:
    """Parts divided where concave creases, or the rims of a bore, separate pieces of the fraction `least` of the area, (m,).

    Thickness alone cannot tell a flange from a wall as thick as it.
    """
    pairs = surface.pairs
    within = parts[pairs[:, 0]] == parts[pairs[:, 1]]
    hollow = _hollow_faces(surface)
    inside = hollow[pairs].sum(axis=1)  # (e,) of the two faces
    crease = (surface.angles_rad < -CREASE_RAD) | ((surface.bends_rad < -CREASE_RAD) & (inside < 2))  # a small bore bends too
    rim = (inside == 1) & (np.maximum(np.abs(surface.angles_rad), np.abs(surface.bends_rad)) > EDGE_RAD)
    apart = crease | rim
    pieces = connected_labels(pairs[within & ~apart], len(parts))
    return merged_small(pieces, surface, least, within)


def merged_small(parts: IntArray, surface: Surface, least: float, within: BoolArray | None = None) -> IntArray:
    """Parts with those that are small, then those that are ragged, joined to a neighbour, (m,), the smallest first.

    Small is below the fraction `least` of the area. Of its neighbours (across the edges `within`, all where None) a part
    joins the one with the costliest common border: the one that it continues. Small parts that joined each other go on
    until they reach one that is not small; without any neighbour left they stay.
    """
    least_mm2 = least * float(surface.areas_mm2.sum())
    size = np.bincount(parts, weights=surface.areas_mm2)
    parts = _joined(parts, size < least_mm2, surface, within)  # first: crumbs along a border would make it look ragged
    parts = np.unique(parts, return_inverse=True)[1]
    size = np.bincount(parts, weights=surface.areas_mm2)
    ends, among = _ends(parts, surface, within)
    outline_mm = np.bincount(ends.ravel(), np.repeat(surface.lengths_mm[among], 2), len(size))
    return _joined(parts, (size < least_mm2) | (outline_mm**2 > RAGGED * size), surface, within)


def _joined(parts: IntArray, small: BoolArray, surface: Surface, within: BoolArray | None) -> IntArray:
    """Parts with those of `small` (k,) joined to the neighbours that they continue, (m,)."""
    size = np.bincount(parts, weights=surface.areas_mm2)
    across = _border_costs(parts, surface, within)
    into = np.arange(len(size))
    waiting = [(float(size[p]), int(p)) for p in np.flatnonzero(small)]
    heapq.heapify(waiting)
    while waiting:
        area, p = heapq.heappop(waiting)
        if area != size[p] or into[p] != p or not across[p]:
            continue  # it has grown or joined another meanwhile, or fills its surroundings
        q = max(across[p], key=lambda i: (across[p][i], -i))
        for r, cost in across[p].items():
            del across[r][p]
            if r != q:
                across[q][r] = across[r][q] = across[q].get(r, 0.0) + cost
        into[p] = q
        size[q] += size[p]
        if small[q]:
            heapq.heappush(waiting, (float(size[q]), q))
    while (into[into] != into).any():
        into = into[into]
    return np.asarray(into[parts])


def _ends(parts: IntArray, surface: Surface, within: BoolArray | None) -> tuple[IntArray, BoolArray]:
    """The two parts, the lower number first, at each edge between parts, (b, 2), and which edges those are, (e,)."""
    ends = np.sort(parts[surface.pairs], axis=1)  # (e, 2)
    among = ends[:, 0] != ends[:, 1]
    if within is not None:
        among &= within
    return ends[among], among


def _border_costs(parts: IntArray, surface: Surface, within: BoolArray | None) -> list[dict[int, float]]:
    """Cost of the border of each part with each neighbour."""
    count = int(parts.max()) + 1
    ends, among = _ends(parts, surface, within)
    keys, inverse = np.unique(ends @ np.array([count, 1]), return_inverse=True)
    costs = np.bincount(inverse, weights=(surface.lengths_mm * surface.shares)[among], minlength=len(keys))
    across: list[dict[int, float]] = [{} for _ in range(count)]
    for key, cost in zip(keys.tolist(), costs.tolist(), strict=True):
        p, q = divmod(key, count)
        across[p][q] = across[q][p] = cost
    return across


def _hollow_faces(surface: Surface) -> BoolArray:
    """Faces of smooth patches that curve inwards all round, such as bores, (m,); patches end at edges or where all bends."""
    return _hollow_within(surface, np.abs(surface.angles_rad) <= EDGE_RAD) | _hollow_within(
        surface, np.abs(surface.bends_rad) <= EDGE_RAD
    )


def _hollow_within(surface: Surface, smooth: BoolArray) -> BoolArray:
    """Faces of hollow patches that the edges `smooth` (e,) hold together, (m,)."""
    patch = connected_labels(surface.pairs[smooth], len(surface.areas_mm2))
    count = int(patch.max()) + 1
    turn = np.bincount(
        patch[surface.pairs[smooth, 0]], weights=surface.angles_rad[smooth] * surface.lengths_mm[smooth], minlength=count
    )
    area = np.bincount(patch, weights=surface.areas_mm2, minlength=count)
    sums = np.stack([np.bincount(patch, weights=column, minlength=count) for column in surface.area_vectors_mm2.T], axis=1)
    hollow = (turn < -HOLLOW * np.sqrt(area)) & (np.linalg.norm(sums, axis=1) < ROUND * area)
    return np.asarray(hollow[patch])


def segments_of(mesh: Mesh, parts: IntArray) -> tuple[Segment, ...]:
    """One segment a part, numbered in order of first appearance among the faces."""
    _, first, part = np.unique(parts, return_index=True, return_inverse=True)
    order = np.argsort(part, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(part))[:-1])
    areas = face_areas_mm2(mesh)
    return tuple(
        Segment(
            id=i,
            faces=groups[number],
            area_mm2=float(areas[groups[number]].sum()),
            hull_volume_mm3=hull_volume_mm3(mesh.vertices_mm[np.unique(mesh.faces[groups[number]])]),
        )
        for i, number in enumerate(np.argsort(first, kind="stable"))
    )


def hull_volume_mm3(points: FloatArray) -> float:
    """Volume of the convex hull of points (n, 3); 0 where they lie in a plane."""
    centred = points - points.mean(axis=0)
    extent = np.linalg.svd(centred, compute_uv=False)
    if len(points) < 4 or extent[2] <= 1e-9 * extent[0]:
        return 0.0
    try:
        return float(ConvexHull(centred).volume)
    except QhullError:  # flat within Qhull's own tolerance
        return 0.0
