"""Segmentation by surfaces: planes, cylinders, cones and spheres, gathered into bodies and hollows (the paper's future work)."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.shape import FloatArray, Mesh, Segment
from gripwright.geometry.quadrics import KINDS
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.segmenters.extraction import SurfacePatches, surface_patches
from gripwright_builtin.segmenters.patches import grouped
from gripwright_builtin.segmenters.segments import segments_of
from gripwright_builtin.segmenters.surface import surface_of


class PrimitivesSegmenter:
    """Partition by surfaces: convex bodies of planes, cylinders, cones and spheres, and the hollows in them."""

    class Settings(Params):
        """What counts as one surface, and as a segment."""

        distance: float = Field(
            0.002, gt=0.0, le=0.1, description="Largest distance from a surface, as a fraction of the root of the whole area."
        )
        angle: float = Field(20.0, gt=0.0, le=45.0, description="Largest angle to a surface, degrees.")
        min_surface: float = Field(
            0.001, gt=0.0, lt=1.0, description="Smaller surfaces, as a fraction of the area, are not looked for."
        )
        min_area: float = Field(
            0.005, ge=0.0, lt=1.0, description="Smaller segments, as a fraction of the area, join a neighbour."
        )

    key: ClassVar[str] = "primitives"
    params_model: ClassVar[type[Params]] = Settings

    def __init__(self, params: Settings) -> None:
        self._params = params

    def segment(self, component: Component, ctx: RunContext) -> Sequence[Segment]:
        """Partition the faces of the component's mesh; positions smoothed for segmentation are used where there are any."""
        mesh, params = component.mesh, self._params
        if mesh.smooth_vertices_mm is not None:
            mesh = Mesh(vertices_mm=mesh.smooth_vertices_mm, faces=mesh.faces)
        with ctx.timed("segment.adjacency"):
            surface = surface_of(mesh)
            area = float(surface.areas_mm2.sum())
        with ctx.timed("segment.surfaces"):
            distance = params.distance * float(np.sqrt(area))
            found = surface_patches(mesh, surface, distance, float(np.radians(params.angle)), params.min_surface * area, ctx.rng)
        ctx.progress(0.8, "surfaces")
        ctx.remarks.append(_remark(found, surface.areas_mm2, params.min_area))
        with ctx.timed("segment.components"):
            return segments_of(component.mesh, grouped(found.patches, surface, params.min_area))


def _remark(found: SurfacePatches, areas_mm2: FloatArray, least: float) -> str:
    """How many surfaces of each kind were found, of those that are no mere details, and how much they explain."""
    area = np.bincount(found.patches, areas_mm2, len(found.kinds))
    large = area >= least * area.sum()
    counts = [int((large & (found.kinds == kind)).sum()) for kind in range(len(KINDS))]
    listed = ", ".join(f"{count} {name}{'s' * (count > 1)}" for count, name in zip(counts, KINDS, strict=True) if count)
    share = float(area[found.kinds >= 0].sum() / area.sum())
    return f"primitives: {listed or 'no surface of note'}; planes, cylinders, cones and spheres explain {100 * share:.0f} % of it"
