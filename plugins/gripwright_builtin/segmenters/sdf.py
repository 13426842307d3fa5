"""Segmentation by shape diameter (Shapira, Shamir and Cohen-Or, 2008), the paper's and CGAL's method."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.shape import FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.measures import face_centres_mm
from gripwright.geometry.shape_diameter import coordinate_tangents, filled, principal_tangents, shape_diameters_mm
from gripwright.geometry.smooth import bilateral, ring_bilateral
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.segmenters.energy import area_energy, published_energy
from gripwright_builtin.segmenters.graph_cut import alpha_expansion, expansion_coarse_to_fine
from gripwright_builtin.segmenters.segments import connected_parts, divided_at_creases, merged_small, segments_of
from gripwright_builtin.segmenters.soft_clustering import cluster_count, cluster_probabilities
from gripwright_builtin.segmenters.surface import Surface, sampled_faces, surface_groups, surface_of

WINDOW = 0.03
"""Radius of the smoothing window, as a fraction of the square root of the surface's area."""
LOGARITHM_SCALE = 5.0
"""Differences among thin parts count more than among thick ones: values v in 0..1 become log(1 + 5 v) / log 6."""
TAIL = 0.01
GROUPS = 4000
"""Patches of the surface that are labelled as one before their borders are looked at face by face."""


class SdfSegmenter:
    """Partition by how thick the component is behind its surface, with borders preferably along concave creases."""

    class Settings(Params):
        """Names and defaults as in the paper and CGAL."""

        rays: int = Field(30, ge=1, le=1000, description="Rays a face.")
        cone_angle: float = Field(120.0, gt=0.0, lt=180.0, description="Full angle of the cone of rays, degrees.")
        clusters: Annotated[int, Field(ge=1, le=50)] | Literal["auto"] = Field(
            5, description="Levels of thickness that are told apart; auto: as many as the Bayesian information criterion prefers."
        )
        smoothness: float = Field(0.26, ge=0.0, le=1.0, description="Weight of short borders against thickness.")
        samples: int = Field(
            40_000,
            ge=1000,
            description="Faces that rays are shot from, spread evenly over the surface (energy area); the rest "
            "take the mean of their neighbours.",
        )
        energy: Literal["area", "published"] = Field(
            "area",
            description="area: independent of the tessellation and the pose, borders at creases; published: rays from every "
            "face, cones turned and values smoothed as in CGAL, every face and edge counts alike, and connected labels are the "
            "segments.",
        )
        min_area: float = Field(
            0.005, ge=0.0, lt=1.0, description="Smaller segments, as a fraction of the surface, join a neighbour (energy area)."
        )
        crease_area: float = Field(
            0.03,
            gt=0.0,
            le=1.0,
            description="Pieces of a segment that concave creases or the rims of a bore separate become segments from this "
            "fraction of the surface on (energy area).",
        )

    key: ClassVar[str] = "sdf"
    params_model: ClassVar[type[Params]] = Settings

    def __init__(self, params: Settings) -> None:
        self._params = params

    def segment(self, component: Component, ctx: RunContext) -> Sequence[Segment]:
        """Partition the faces of the component's mesh; positions smoothed for segmentation are used where there are any."""
        mesh, params = _segmentation_mesh(component.mesh), self._params
        with ctx.timed("segment.adjacency"):
            surface = surface_of(mesh)
        diameters = self.shape_diameters_mm(mesh, surface, ctx)
        ctx.face_values["sdf"] = diameters
        ctx.progress(0.6, "shape diameters")
        with ctx.timed("segment.cluster"):
            by_area = params.energy == "area"
            weights = surface.areas_mm2 if by_area else np.ones_like(surface.areas_mm2)
            levels = _normalised(diameters, weights)
            count = cluster_count(levels, weights, by_area) if params.clusters == "auto" else params.clusters
            probabilities = cluster_probabilities(levels, weights, count, common_spread=by_area)
        if params.clusters == "auto":
            ctx.remarks.append(f"{count} levels of thickness, by the Bayesian information criterion")
        ctx.progress(0.7, "levels of thickness")
        with ctx.timed("segment.cut"):
            labels = self._labels(probabilities, mesh, surface)
        ctx.progress(0.9, "borders")
        with ctx.timed("segment.components"):
            return segments_of(component.mesh, self._parts(labels, surface))

    def shape_diameters_mm(self, mesh: Mesh, surface: Surface, ctx: RunContext) -> FloatArray:
        """Thickness behind each face, (m,): mean ray length, gaps filled, smoothed without blurring steps."""
        with ctx.timed("segment.rays"):
            published = self._params.energy == "published"
            chosen = None if published else sampled_faces(mesh, self._params.samples)
            tangents = coordinate_tangents if published else principal_tangents
            raw = shape_diameters_mm(mesh, self._params.rays, np.radians(self._params.cone_angle), chosen, tangents)
        with ctx.timed("segment.smooth"):
            if published:
                return ring_bilateral(filled(raw, surface.pairs), surface.pairs)
            window = WINDOW * np.sqrt(surface.areas_mm2.sum())
            return bilateral(filled(raw, surface.pairs), face_centres_mm(mesh), surface.areas_mm2, surface.pairs, window)

    def _labels(self, probabilities: FloatArray, mesh: Mesh, surface: Surface) -> IntArray:
        """The labelling of least energy that expansions reach, (m,)."""
        if self._params.energy == "published":
            energy = published_energy(probabilities, surface.angles_rad, self._params.smoothness)
            return alpha_expansion(energy.data, surface.pairs, energy.borders)
        energy = area_energy(probabilities, surface.areas_mm2, surface.shares, surface.lengths_mm, self._params.smoothness)
        return expansion_coarse_to_fine(energy.data, surface.pairs, energy.borders, surface_groups(mesh, surface, GROUPS))

    def _parts(self, labels: IntArray, surface: Surface) -> IntArray:
        parts = connected_parts(labels, surface.pairs)
        if self._params.energy == "published":
            return parts
        return divided_at_creases(merged_small(parts, surface, self._params.min_area), surface, self._params.crease_area)


def _normalised(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Shape diameters as numbers from 0 to 1 whose differences say how different the thickness is.

    A hundredth of the weight at either end counts as 0 and as 1: a few faces in corners say nothing about all the others.
    """
    order = np.argsort(values)
    covered = np.cumsum(weights[order])
    low, high = values[order[np.searchsorted(covered, np.array([TAIL, 1.0 - TAIL]) * covered[-1])]]
    if high - low <= 1e-9 * high:
        return np.zeros_like(values)
    share = np.clip((values - low) / (high - low), 0.0, 1.0)
    return np.asarray(np.log1p(share * LOGARITHM_SCALE) / np.log1p(LOGARITHM_SCALE))


def _segmentation_mesh(mesh: Mesh) -> Mesh:
    if mesh.smooth_vertices_mm is None:
        return mesh
    return Mesh(vertices_mm=mesh.smooth_vertices_mm, faces=mesh.faces)
