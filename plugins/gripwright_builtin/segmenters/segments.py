"""From labels of faces to segments: connected, not too small, measured. Shared by segmenters."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from gripwright.domain.shape import FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.adjacency import connected_labels
from gripwright.geometry.measures import face_areas_mm2


def connected_parts(labels: IntArray, pairs: IntArray) -> IntArray:
    """Number of each face's connected set of equally labelled faces, (m,)."""
    return connected_labels(pairs[labels[pairs[:, 0]] == labels[pairs[:, 1]]], len(labels))


def merged_small(parts: IntArray, pairs: IntArray, borders: FloatArray, areas: FloatArray, least: float) -> IntArray:
    """Parts with those below the fraction `least` of the area joined, smallest first, to a neighbour, (m,).

    Of its neighbours the one with the costliest common border (`borders`, (e,)): the one that it continues.
    A part without neighbours stays.
    """
    size = np.bincount(parts, weights=areas)
    limit = least * size.sum()
    across: list[dict[int, float]] = [{} for _ in size]
    ends = parts[pairs]  # (e, 2)
    apart = ends[:, 0] != ends[:, 1]
    keys, inverse = np.unique(np.sort(ends[apart], axis=1) @ np.array([len(size), 1]), return_inverse=True)
    for key, cost in zip(keys.tolist(), np.bincount(inverse, weights=borders[apart]).tolist(), strict=True):
        p, q = divmod(key, len(size))
        across[p][q] = across[q][p] = cost
    into = np.arange(len(size))
    waiting = {int(p) for p in np.flatnonzero(size < limit) if across[p]}
    while waiting:
        p = min(waiting, key=lambda i: (size[i], i))
        q = max(across[p], key=lambda i: (across[p][i], -i))
        for r, cost in across[p].items():
            del across[r][p]
            if r != q:
                across[q][r] = across[r][q] = across[q].get(r, 0.0) + cost
        into[into == p] = q
        size[q] += size[p]
        waiting.discard(p)
        if size[q] >= limit or not across[q]:
            waiting.discard(q)
    return np.asarray(into[parts])


def segments_of(mesh: Mesh, parts: IntArray) -> tuple[Segment, ...]:
    """One segment a part, numbered in order of first appearance among the faces of the file."""
    numbers, first, part = np.unique(parts, return_index=True, return_inverse=True)
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
        for i, number in enumerate(np.argsort(first, kind="stable")[: len(numbers)])
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
