"""Segmentation by shape diameter (Shapira, Shamir and Cohen-Or, 2008), the paper's and CGAL's method."""

from collections.abc import Sequence
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.shape import FloatArray, Mesh, Segment
from gripwright.geometry.adjacency import Adjacency, edge_lengths_mm, exterior_angles_rad, face_adjacency
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm
from gripwright.geometry.shape_diameter import filled, shape_diameters_mm
from gripwright.geometry.smooth import bilateral
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.segmenters.graph_cut import alpha_expansion
from gripwright_builtin.segmenters.segments import connected_parts, merged_small, segments_of
from gripwright_builtin.segmenters.soft_clustering import cluster_probabilities

PROBABILITY_MIN = 5e-6
CONVEX_FACTOR = 0.08
"""A convex edge counts as this part of its angle: people cut along concave creases (minima rule)."""
SMOOTHNESS_SCALE = 100.0
REFERENCE_FACES = 20_000
"""The area-weighted energy equals the published one on an even mesh of so many faces."""
WINDOW = 0.03
"""Radius of the smoothing window, as a fraction of the square root of the surface's area."""
LOGARITHM_SCALE = 5.0
"""Differences among thin parts count more than among thick ones: values v in 0..1 become log(1 + 5 v) / log 6."""


class SdfSegmenter:
    """Partition by how thick the component is behind its surface, with borders preferably along concave creases."""

    class Settings(Params):
        """Names and defaults as in the paper and CGAL."""

        rays: int = Field(30, ge=1, le=1000, description="Rays a face.")
        cone_angle: float = Field(120.0, gt=0.0, lt=180.0, description="Full angle of the cone of rays, degrees.")
        clusters: int = Field(5, ge=1, le=50, description="Levels of thickness that are told apart.")
        smoothness: float = Field(0.26, ge=0.0, le=1.0, description="Weight of short borders against thickness.")
        energy: Literal["area", "published"] = Field(
            "area", description="area: independent of the tessellation; published: each face and edge counts alike, as in CGAL."
        )
        min_area: float = Field(
            0.003, ge=0.0, lt=1.0, description="Smaller segments, as a fraction of the surface, join a neighbour."
        )

    key: ClassVar[str] = "sdf"
    params_model: ClassVar[type[Params]] = Settings

    def __init__(self, params: Settings) -> None:
        self._params = params

    def segment(self, component: Component, ctx: RunContext) -> Sequence[Segment]:
        """Partition the faces of the component's mesh; positions smoothed for segmentation are used where there are any."""
        mesh, params = _segmentation_mesh(component.mesh), self._params
        with ctx.timed("segment.rays"):
            raw = shape_diameters_mm(mesh, params.rays, np.radians(params.cone_angle))
        ctx.progress(0.5, "shape diameters")
        with ctx.timed("segment.adjacency"):
            adjacency = face_adjacency(mesh)
            areas = face_areas_mm2(mesh)
        with ctx.timed("segment.smooth"):
            window = WINDOW * np.sqrt(areas.sum())
            smooth = bilateral(filled(raw, adjacency.pairs), face_centres_mm(mesh), areas, adjacency.pairs, window)
        with ctx.timed("segment.cluster"):
            weights = areas if params.energy == "area" else np.ones_like(areas)
            probabilities = cluster_probabilities(_normalised(smooth), weights, params.clusters)
        ctx.progress(0.7, "thickness clusters")
        with ctx.timed("segment.cut"):
            data, costs, borders = self._energy(mesh, adjacency, areas, probabilities)
            labels = alpha_expansion(data, adjacency.pairs, costs)
        ctx.progress(0.9, "borders")
        with ctx.timed("segment.components"):
            parts = merged_small(connected_parts(labels, adjacency.pairs), adjacency.pairs, borders, areas, params.min_area)
            return segments_of(component.mesh, parts)

    def _energy(
        self, mesh: Mesh, adjacency: Adjacency, areas: FloatArray, probabilities: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs of each face's labels (m, k) and of borders at each edge (e,); the latter by length and angle alone."""
        data = -np.log(np.maximum(probabilities, PROBABILITY_MIN))
        turn = border_costs(exterior_angles_rad(mesh, adjacency))
        weight = SMOOTHNESS_SCALE * self._params.smoothness
        lengths = edge_lengths_mm(mesh, adjacency)
        if self._params.energy == "published":
            return data, weight * turn, turn * lengths
        # An even mesh of N triangles of total area A has edges of length sqrt(4 A / (√3 N)).
        face = areas.sum() / REFERENCE_FACES
        edge = np.sqrt(4.0 * face / np.sqrt(3.0))
        return data * (areas / face)[:, None], weight * turn * lengths / edge, turn * lengths


def border_costs(exterior_angles_rad: FloatArray) -> FloatArray:
    """Cost of a border along an edge, (e,): high where the surface is flat, low at concave creases, between at convex ones."""
    share = np.abs(exterior_angles_rad) / np.pi * np.where(exterior_angles_rad > 0, CONVEX_FACTOR, 1.0)
    return np.asarray(-np.log(np.clip(share, PROBABILITY_MIN, 1.0 - PROBABILITY_MIN)))


def _normalised(values: FloatArray) -> FloatArray:
    """Shape diameters as numbers from 0 to 1 whose differences say how different the thickness is."""
    low, high = float(values.min()), float(values.max())
    if high - low <= 1e-9 * high:
        return np.zeros_like(values)
    return np.asarray(np.log1p((values - low) / (high - low) * LOGARITHM_SCALE) / np.log1p(LOGARITHM_SCALE))


def _segmentation_mesh(mesh: Mesh) -> Mesh:
    if mesh.smooth_vertices_mm is None:
        return mesh
    return Mesh(vertices_mm=mesh.smooth_vertices_mm, faces=mesh.faces)
