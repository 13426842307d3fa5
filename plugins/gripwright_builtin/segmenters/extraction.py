"""Which plane, cylinder, cone or sphere each part of a surface lies on (after Schnabel, Wahl and Klein, 2007)."""

from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import connected_labels
from gripwright.geometry.consensus import sample_surface
from gripwright.geometry.corners import corner_vertices
from gripwright.geometry.facets import coplanar_patches
from gripwright.geometry.measures import face_centres_mm
from gripwright.geometry.quadrics import KINDS, Quadrics, closeness, fitted, propose
from gripwright_builtin.segmenters.surface import Surface

SMOOTH_RAD = np.radians(42.0)
"""Edges below this may be those of facets of one curved surface: nine sides are round, eight are not."""
SAMPLES = 400
PLANES = 16  # largest samples whose planes are looked at
ROUNDS, BATCH = 8, 6  # of hypotheses a region, and surfaces kept of each round
SIMPLER = np.array([1.0, 0.98, 0.96, 0.94])
"""A cylinder must explain 2 % more than a plane, a cone 2 % more than a cylinder, …"""
LEFT = 0.01
"""Part of a region that may stay unexplained."""
NO_SURFACE = -1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfacePatches:
    """The patch of each face, (m,), and the kind of surface of each patch, (k,): its place in `KINDS`, or `NO_SURFACE`."""

    patches: IntArray
    kinds: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Facets:
    """The planar pieces that a mesh consists of."""

    facet: IntArray  # (m,) of each face
    areas_mm2: FloatArray  # (f,)
    centres_mm: FloatArray  # (f, 3)
    normals: FloatArray  # (f, 3)
    depths_mm: FloatArray  # (f,) of a centre below the curved surface that the facet may be a chord of
    pairs: IntArray  # (p, 2) facets that meet without a sharp edge


def surface_patches(
    mesh: Mesh, surface: Surface, distance_mm: float, angle_rad: float, area_min_mm2: float, rng: np.random.Generator
) -> SurfacePatches:
    """Connected patches of one surface each.

    A facet lies on a surface from which its centre is at most `distance_mm` away, besides the depth of a chord, and its
    normal at most `angle_rad`. Surfaces of less than `area_min_mm2` are not looked for.
    """
    facets = _facets(mesh, surface)
    count = len(facets.areas_mm2)
    region = connected_labels(facets.pairs, count)
    area = np.bincount(region, facets.areas_mm2)
    order = np.argsort(region, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(region))[:-1])
    corners = np.zeros(len(mesh.vertices_mm), dtype=bool)
    corners[corner_vertices(mesh, np.arange(len(mesh.vertices_mm)))] = True
    search = _Search(mesh, facets, corners, distance_mm, angle_rad, area_min_mm2)
    for number in np.argsort(-area, kind="stable"):
        if area[number] >= area_min_mm2:
            search.divide(members[number], rng)
    same = search.label[facets.pairs[:, 0]] == search.label[facets.pairs[:, 1]]
    patch = connected_labels(facets.pairs[same], count)
    kinds = np.full(int(patch.max()) + 1, NO_SURFACE)
    kinds[patch] = search.kind
    return SurfacePatches(patches=patch[facets.facet], kinds=kinds)


class _Search:
    """Names surfaces facet by facet: `label` is the number of a facet's surface, `kind` its kind."""

    def __init__(
        self, mesh: Mesh, facets: _Facets, corners: BoolArray, distance_mm: float, angle_rad: float, area_min_mm2: float
    ) -> None:
        self._mesh, self._facets, self._corners = mesh, facets, corners
        self._tolerances_mm = distance_mm + facets.depths_mm
        self._angle_rad, self._area_min_mm2 = angle_rad, area_min_mm2
        order = np.argsort(facets.facet, kind="stable")
        self._faces = np.split(order, np.cumsum(np.bincount(facets.facet))[:-1])  # of each facet
        self.label = np.full(len(facets.areas_mm2), NO_SURFACE)
        self.kind = np.full(len(facets.areas_mm2), NO_SURFACE)
        self._named = 0

    def divide(self, region: IntArray, rng: np.random.Generator) -> None:
        """Name the surfaces of a smooth region of facets, the one that explains most first."""
        areas = self._facets.areas_mm2
        left, total = region, areas[region].sum()
        for _ in range(ROUNDS):
            if len(left) == 1:
                self._name(left, KINDS.index("plane"))
            if len(left) < 2 or areas[left].sum() < max(self._area_min_mm2, LEFT * total):
                return
            if not self._round(left, rng):
                return
            left = left[self.label[left] == NO_SURFACE]

    def _round(self, left: IntArray, rng: np.random.Generator) -> bool:
        """Name some surfaces among the facets left, from one set of hypotheses; False where there was none."""
        facets, found = self._facets, False
        samples = sample_surface(facets.centres_mm[left], facets.normals[left], facets.areas_mm2[left], SAMPLES, rng)
        planes = np.unique(samples.faces[np.argsort(-facets.areas_mm2[left][samples.faces], kind="stable")][:PLANES])
        planes = np.array([np.flatnonzero(samples.faces == face)[0] for face in planes])
        hypotheses = propose(samples.points_mm, samples.normals, planes, rng)
        chosen = left[samples.faces]
        support = self._closeness(hypotheses, chosen) * samples.areas_mm2 * SIMPLER[hypotheses.kinds, None]
        for _ in range(BATCH):
            best = np.array([support.sum(axis=1).argmax()])
            free = left[self.label[left] == NO_SURFACE]
            members = self._members(hypotheses.select(best), free)
            if not len(members) or facets.areas_mm2[members].sum() < self._area_min_mm2:
                break
            self._name(members, int(hypotheses.kinds[best[0]]))
            support[:, self.label[chosen] != NO_SURFACE] = 0.0
            found = True
        return found

    def _members(self, one: Quadrics, free: IntArray) -> IntArray:
        """The connected facets of most area that follow a surface, before or after its fit to their corners."""
        members = self._connected(free[self._closeness(one, free)[0] > 0])
        if not len(members):
            return members
        faces = np.concatenate([self._faces[facet] for facet in members])
        vertices = np.unique(self._mesh.faces[faces])
        better = fitted(one, self._mesh.vertices_mm[vertices[self._corners[vertices]]])
        again = self._connected(free[self._closeness(better, free)[0] > 0])
        areas = self._facets.areas_mm2
        return again if areas[again].sum() > areas[members].sum() else members

    def _connected(self, members: IntArray) -> IntArray:
        inside = np.zeros(len(self.label), dtype=bool)
        inside[members] = True
        pairs = self._facets.pairs
        piece = connected_labels(pairs[inside[pairs].all(axis=1)], len(inside))[members]
        if not len(members):
            return members
        return np.asarray(members[piece == np.bincount(piece, self._facets.areas_mm2[members]).argmax()])

    def _closeness(self, quadrics: Quadrics, facets: IntArray) -> FloatArray:
        f = self._facets
        return closeness(quadrics, f.centres_mm[facets], f.normals[facets], self._tolerances_mm[facets], self._angle_rad)

    def _name(self, members: IntArray, kind: int) -> None:
        self.label[members], self.kind[members] = self._named, kind
        self._named += 1


def _facets(mesh: Mesh, surface: Surface) -> _Facets:
    facet = coplanar_patches(mesh, np.arange(len(mesh.faces)))
    count = int(facet.max()) + 1
    area = np.bincount(facet, surface.areas_mm2, count).astype(np.float64)
    moments = face_centres_mm(mesh) * surface.areas_mm2[:, None]
    centres, vectors = (
        np.stack([np.bincount(facet, column, count) for column in values.T], axis=1)  # (f, 3)
        for values in (moments, surface.area_vectors_mm2)
    )
    ends = facet[surface.pairs]
    joined = (ends[:, 0] != ends[:, 1]) & (np.abs(surface.angles_rad) <= SMOOTH_RAD)
    keys, inverse = np.unique(np.sort(ends[joined], axis=1) @ np.array([count, 1]), return_inverse=True)
    length = np.bincount(inverse, surface.lengths_mm[joined])
    angle = np.bincount(inverse, surface.lengths_mm[joined] * np.abs(surface.angles_rad[joined])) / np.maximum(length, 1e-300)
    pairs = np.stack(np.divmod(keys, count), axis=1)
    side, turn = np.zeros(count), np.zeros(count)
    for k in (0, 1):
        np.maximum.at(side, pairs[:, k], length)
        np.maximum.at(turn, pairs[:, k], angle)
    safe = np.maximum(area, 1e-300)[:, None]
    width = np.divide(area, side, out=np.zeros(count), where=side > 0)
    return _Facets(
        facet=facet,
        areas_mm2=area,
        centres_mm=centres / safe,
        normals=vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300),
        depths_mm=width * turn / 8.0,  # of a chord of that width that turns so far
        pairs=pairs,
    )
