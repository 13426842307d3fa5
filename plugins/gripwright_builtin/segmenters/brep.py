"""Segmentation by the faces of the CAD model itself, which a STEP file brings with it."""

from collections.abc import Sequence
from typing import ClassVar

from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Segment
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.segmenters.patches import grouped
from gripwright_builtin.segmenters.segments import segments_of
from gripwright_builtin.segmenters.surface import surface_of


class BrepSegmenter:
    """Partition by the faces of a STEP file, those of one body together. What it was tessellated to makes no difference."""

    class Settings(Params):
        """How small a segment may be."""

        min_area: float = Field(
            0.005, ge=0.0, lt=1.0, description="Smaller segments, as a fraction of the surface, join a neighbour."
        )

    key: ClassVar[str] = "brep"
    params_model: ClassVar[type[Params]] = Settings

    def __init__(self, params: Settings) -> None:
        self._params = params

    def segment(self, component: Component, ctx: RunContext) -> Sequence[Segment] | Rejection:
        """Partition the faces of the component's mesh; a Rejection where the file has triangles alone."""
        mesh = component.mesh
        if mesh.cad_faces is None:
            return Rejection(
                "no-cad-faces", "its file has triangles alone, not the faces of a CAD model as STEP has: use segmenter=sdf"
            )
        with ctx.timed("segment.adjacency"):
            surface = surface_of(mesh)
        ctx.progress(0.5, "borders of the CAD faces")
        with ctx.timed("segment.components"):
            return segments_of(mesh, grouped(mesh.cad_faces, surface, self._params.min_area))
