"""Lengths of a file to mm. The unit is always an argument: nothing guesses it."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh

MM_PER_UNIT: Mapping[str, float] = MappingProxyType(
    {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8, "micron": 0.001}
)


def mesh_in_mm(vertices: FloatArray, faces: IntArray, unit: str) -> Mesh:
    """A mesh in mm of vertices (n, 3) in `unit` (a key of MM_PER_UNIT) and faces (m, 3); the arguments stay as they are."""
    return Mesh(vertices_mm=np.asarray(vertices * MM_PER_UNIT[unit], dtype=np.float64), faces=faces)
