"""A segment's surface as flat patches with their true corners: what the fitters of round shapes look at.

A tessellated surface has its corners on the true surface, and the middles of its facets beside it. So the corners say where a
surface lies, the flat patches which way it faces, and how much of it there is.
"""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.corners import corner_vertices
from gripwright.geometry.facets import coplanar_patches
from gripwright.geometry.measures import face_cross_mm2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlatPatches:
    """Flat patches; lengths are shares of `size_mm`, places relative to `origin_mm`."""

    centres: FloatArray  # (k, 3)
    normals: FloatArray  # (k, 3) outward unit
    areas: FloatArray  # (k,)
    points: FloatArray  # (q, 3) the true corners of one patch after the other
    start: IntArray  # (k,) where those of each patch begin
    origin_mm: FloatArray  # (3,)
    size_mm: float

    @property
    def counts(self) -> IntArray:
        """Corners of each patch, (k,)."""
        return np.diff(self.start, append=len(self.points))

    @property
    def facing(self) -> FloatArray:
        """The patch's normal at each of its corners, (q, 3)."""
        return np.repeat(self.normals, self.counts, axis=0)

    @property
    def weights(self) -> FloatArray:
        """Area that each corner stands for, (q,)."""
        return np.repeat(self.areas / self.counts, self.counts)

    def select(self, which: BoolArray | IntArray) -> "FlatPatches":
        """Some of them."""
        counts = self.counts[which]
        start = np.cumsum(counts) - counts
        index = np.repeat(self.start[which] - start, counts) + np.arange(counts.sum())
        return FlatPatches(
            centres=self.centres[which],
            normals=self.normals[which],
            areas=self.areas[which],
            points=self.points[index],
            start=start,
            origin_mm=self.origin_mm,
            size_mm=self.size_mm,
        )

    def drawn(self, rng: np.random.Generator, count: int, each: int) -> IntArray:
        """`count` draws of `each` patches, half of the chance by area and half alike, (count, each)."""
        chance = self.areas / self.areas.sum() + 1.0 / len(self.areas)
        return np.asarray(rng.choice(len(self.areas), size=(count, each), p=chance / chance.sum()))

    def place_mm(self, point: FloatArray) -> FloatArray:
        """A place (…, 3) in the component's frame."""
        return np.asarray(point * self.size_mm + self.origin_mm)


def flat_patches(mesh: Mesh, faces: IntArray) -> FlatPatches:
    """The given faces as flat patches; those without area, or without three corners of their own, are left out."""
    part = Mesh(vertices_mm=mesh.vertices_mm, faces=mesh.faces[faces])
    used = np.unique(part.faces)
    low, high = mesh.vertices_mm[used].min(axis=0), mesh.vertices_mm[used].max(axis=0)
    origin, size = (low + high) / 2.0, max(float((high - low).max()), 1e-300)
    patch = coplanar_patches(mesh, faces)  # (m,)
    count = int(patch.max(initial=-1)) + 1
    vectors = face_cross_mm2(part) / 2.0 / size**2  # (m, 3)
    areas = np.linalg.norm(vectors, axis=1)
    total = np.asarray(np.bincount(patch, areas, count), dtype=np.float64)
    mean = np.stack([np.bincount(patch, vectors[:, k], count) for k in range(3)], axis=1)
    middles = (part.triangles_mm.mean(axis=1) - origin) / size
    centre = np.stack([np.bincount(patch, areas * middles[:, k], count) for k in range(3)], axis=1)
    true = np.zeros(len(mesh.vertices_mm), dtype=bool)
    true[corner_vertices(mesh, used)] = True
    owner, vertex = np.repeat(patch, 3), part.faces.ravel()
    pairs = np.unique(owner[true[vertex]] * len(true) + vertex[true[vertex]])  # each corner once a patch
    owner, vertex = pairs // len(true), pairs % len(true)
    corners = np.bincount(owner, minlength=count)
    whole = FlatPatches(
        centres=centre / np.maximum(total, 1e-300)[:, None],
        normals=mean / np.maximum(np.linalg.norm(mean, axis=1), 1e-300)[:, None],
        areas=total,
        points=(mesh.vertices_mm[vertex] - origin) / size,
        start=np.cumsum(corners) - corners,
        origin_mm=origin,
        size_mm=size,
    )
    return whole.select((total > 1e-12) & (corners >= 3))
