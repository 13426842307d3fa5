"""An extruded profile is held across parallel facets of its outline."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import EXTERNAL, PARALLEL_2, GripRequirement
from gripwright.domain.shape import Primitive
from gripwright.plugin_api import Params
from gripwright_builtin.shapes.extrusion import Extrusion
from gripwright_builtin.shapes.outline import edges_of

_NO_TYPE = "no-type"
_PARALLEL = float(np.cos(np.radians(1.0)))


class ExtrusionHoldParams(Params):
    """Parameters of the rule."""

    overlap_min: float = Field(3.0, gt=0, le=100, description="mm, least length along which parallel facets lie opposite.")
    pairs_max: int = Field(4, ge=1, le=20, description="Pairs of facets asked for at the most.")


class TwoFingerExtrusion:
    """Select a parallel gripper across each pair of facets that face away from each other, the longest overlap first."""

    key: ClassVar[str] = "two_finger_extrusion"
    params_model: ClassVar[type[ExtrusionHoldParams]] = ExtrusionHoldParams
    accepts: ClassVar[frozenset[str]] = frozenset({"extrusion"})

    def __init__(self, params: ExtrusionHoldParams) -> None:
        self._params = params

    def apply(self, fit: Primitive) -> Sequence[GripRequirement] | Rejection:
        """A requirement a pair, from any direction within the facets; `no-type` where none is long enough."""
        if not isinstance(fit, Extrusion):
            return Rejection(_NO_TYPE, f"primitive is a {fit.kind}, not an extrusion")
        if fit.internal:
            return Rejection(_NO_TYPE, "the extrusion is a pocket, held from outside only")
        overlaps, widths, normals = _pairs(fit)
        longest = float(overlaps.max(initial=0.0))
        if longest < self._params.overlap_min:
            return Rejection(
                _NO_TYPE, f"parallel facets lie opposite along {longest:.2f} mm, at least {self._params.overlap_min:.2f} mm"
            )
        best = np.argsort(-np.round(overlaps, 3), kind="stable")[: self._params.pairs_max]
        return [
            GripRequirement(
                gripper_type=PARALLEL_2,
                opening_width_mm=float(widths[k]),
                grip=EXTERNAL,
                approach_C=np.zeros((0, 3)),
                grip_axes_C=(fit.X_CB[:3, :2] @ normals[k])[None],
                primitive=fit,
                rule=self.key,
            )
            for k in best
            if overlaps[k] >= self._params.overlap_min
        ]


def _pairs(fit: Extrusion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Overlap, distance and direction of each pair of edges of the outline that face away from each other; (p,), (p,), (p, 2)."""
    begin, end, normals = edges_of(fit.outline_B)
    first, second = np.nonzero(np.triu(normals @ normals.T <= -_PARALLEL))
    normal = normals[first]
    along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)  # the direction of the first edge
    width = ((begin[first] - begin[second]) * normal).sum(axis=1)
    spans = [
        np.sort([(p * along).sum(axis=1), (q * along).sum(axis=1)], axis=0)
        for p, q in ((begin[first], end[first]), (begin[second], end[second]))
    ]
    overlap = np.minimum(spans[0][1], spans[1][1]) - np.maximum(spans[0][0], spans[1][0])
    apart = width > 0.0
    return overlap[apart], width[apart], normal[apart]
