"""Planar clustering: the faces of a mesh gathered into nearly planar facets (paper, section 5.2.2). Lengths in mm."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import connected_labels, face_adjacency
from gripwright.geometry.measures import face_areas_mm2, face_normals

COPLANAR_RAD = 1e-3
"""Faces whose normals differ by less lie in one plane: above the rounding of STL files, below any facet of a curved surface."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Facet:
    """A connected, nearly planar set of faces; its plane is {p : normal · p = offset}."""

    faces: IntArray  # (k,) indices into mesh.faces, ascending
    normal: FloatArray  # (3,) unit, the area-weighted mean of the faces' normals, outwards
    offset_mm: float  # area-weighted mean of normal · centre
    area_mm2: float


def coplanar_patches(mesh: Mesh, faces: IntArray) -> IntArray:
    """Patch number of each of the given faces, (k,): connected faces of one plane share one."""
    part = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[faces])
    normals, pairs = face_normals(part), face_adjacency(part).pairs
    # |n1 - n2| is the angle for small ones, and unlike arccos keeps its digits there
    flat = np.linalg.norm(normals[pairs[:, 0]] - normals[pairs[:, 1]], axis=1) < COPLANAR_RAD
    return connected_labels(pairs[flat], len(faces))


def facets(mesh: Mesh, faces: IntArray, angle_rad: float) -> list[Facet]:
    """The given faces as facets, the largest first; every face with area is in exactly one.

    A facet grows from its largest coplanar patch over shared edges, and takes a patch whose normal is within `angle_rad`
    (closed) of the seed's and of the facet's mean normal so far.
    """
    part = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[faces])
    areas, normals = face_areas_mm2(part), face_normals(part)
    patches = coplanar_patches(mesh, faces)
    count = int(patches.max(initial=-1)) + 1
    vectors = np.stack([np.bincount(patches, areas * normals[:, k], count) for k in range(3)], axis=1)  # (count, 3)
    owner = _grow(vectors, *_neighbour_lists(patches[face_adjacency(part).pairs], count), float(np.cos(angle_rad)))
    label = owner[patches]
    label[areas <= 0] = -1
    centres = part.triangles_mm.mean(axis=1)
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    found = [_facet(faces, group, areas, normals, centres) for group in groups if len(group) and label[group[0]] >= 0]
    return sorted(found, key=lambda facet: (-facet.area_mm2, int(facet.faces[0])))


def _facet(faces: IntArray, group: IntArray, areas: FloatArray, normals: FloatArray, centres: FloatArray) -> Facet:
    area = float(areas[group].sum())
    mean = areas[group] @ normals[group]  # (3,)
    normal = mean / np.linalg.norm(mean)
    offset = float(areas[group] @ (centres[group] @ normal)) / area
    return Facet(faces=np.sort(faces[group]), normal=normal, offset_mm=offset, area_mm2=area)


def _neighbour_lists(pairs: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Neighbours of patch p are `neighbours[start[p] : start[p + 1]]`."""
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[both[:, 0] != both[:, 1]]
    keys = np.unique(both[:, 0] * max(count, 1) + both[:, 1])
    start = np.searchsorted(keys, np.arange(count + 1) * max(count, 1))
    return np.asarray(start, dtype=np.int64), np.asarray(keys % max(count, 1), dtype=np.int64)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _grow(vectors: FloatArray, start: IntArray, neighbours: IntArray, cosine: float) -> IntArray:
    """Facet number of each patch; `vectors` are the patches' area vectors, (count, 3)."""
    count = len(vectors)
    owner = np.full(count, -1, np.int64)
    area = np.sqrt((vectors**2).sum(axis=1))
    queue = np.empty(count, np.int64)
    facet = 0
    for seed in np.argsort(-area, kind="mergesort"):
        if owner[seed] >= 0 or area[seed] <= 0:
            continue
        seed_normal = vectors[seed] / area[seed]
        total = vectors[seed].copy()
        owner[seed] = facet
        queue[0] = seed
        head, tail = 0, 1
        while head < tail:
            patch = queue[head]
            head += 1
            for k in range(start[patch], start[patch + 1]):
                other = neighbours[k]
                if owner[other] >= 0 or area[other] <= 0:
                    continue
                normal = vectors[other] / area[other]
                bound = cosine * np.sqrt((total**2).sum()) - 1e-12 * area[seed]
                if (normal * seed_normal).sum() >= cosine - 1e-12 and (normal * total).sum() >= bound:
                    owner[other] = facet
                    total += vectors[other]
                    queue[tail] = other
                    tail += 1
        facet += 1
    return owner
