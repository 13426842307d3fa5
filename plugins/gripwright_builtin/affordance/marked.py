"""Surface that the package marks as not to be grasped."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from gripwright.domain.affordance import MARKED, Forbidden
from gripwright.domain.assembly import Component, GraspRegion
from gripwright.domain.shape import BoolArray, Segment
from gripwright.plugin_api import Params, RunContext


class MarkedRegions:
    """Turns the component's `no_grasp` regions into forbidden surface."""

    key: ClassVar[str] = MARKED
    params_model: ClassVar[type[Params]] = Params

    def __init__(self, params: Params) -> None:
        self._params = params

    def detect(self, component: Component, segments: Sequence[Segment], ctx: RunContext) -> Sequence[Forbidden]:
        """One entry a region: the faces that reach into its box, cut by the box, or all faces of its segments."""
        return [
            Forbidden(
                reason=region.reason,
                detector=self.key,
                faces=_faces(component, segments, region),
                box_min_C=region.box_min_C,
                box_max_C=region.box_max_C,
            )
            for region in component.no_grasp
        ]


def _faces(component: Component, segments: Sequence[Segment], region: GraspRegion) -> BoolArray:
    count = len(component.mesh.faces)
    if region.box_min_C is None or region.box_max_C is None:
        faces = np.zeros(count, dtype=bool)
        for segment in segments:
            if segment.id in region.segments:
                faces[segment.faces] = True
        return faces
    triangles = component.mesh.triangles_mm
    low, high = triangles.min(axis=1), triangles.max(axis=1)  # (m, 3)
    return np.asarray((low <= region.box_max_C).all(axis=1) & (high >= region.box_min_C).all(axis=1))
