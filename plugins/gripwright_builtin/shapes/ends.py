"""Which end faces a form has."""

import numpy as np

from gripwright.domain.shape import FloatArray
from gripwright_builtin.shapes.patches import FlatPatches

_ACROSS = float(np.cos(np.radians(3.0)))
_NEAR = 0.005  # of the size


def covered_share(patches: FlatPatches, normal: FloatArray, point: FloatArray, area: float) -> float:
    """Share of an end face of that area, through the point and with that outward normal, that patches cover, 0..1."""
    if area <= 0.0:
        return 0.0
    heights = np.maximum.reduceat(np.abs((patches.points - point) @ normal), patches.start)
    on = (patches.normals @ normal >= _ACROSS) & (heights <= _NEAR)
    return min(float(patches.areas[on].sum()) / area, 1.0)
