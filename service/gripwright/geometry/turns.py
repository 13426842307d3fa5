"""Directions about an axis in which evenly spread fingers meet a surface."""

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.measures import face_normals

_COARSE = 37  # from so many facets about the axis on, any direction is within 5° of a facet's normal
_ALIKE = 0.1  # of what a facet's normal has along the axis


def turns_about(
    mesh: Mesh, faces: IntArray, axis: FloatArray, x: FloatArray, count: int, step_rad: float, tilt: float = 0.0
) -> tuple[FloatArray, list[float | None]]:
    """Angles about the axis from `x`, [0, 2π/count), of the first of `count` fingers; how far each stands for those beside it.

    Regular ones, and on a coarse surface those that meet facets, which stand for none. `tilt` is what the surface's normals have
    along the axis.
    """
    pitch = 2.0 * np.pi / count
    regular = np.arange(0.0, pitch - 1e-9, step_rad)
    beside: list[float | None] = [step_rad / 2.0] * len(regular)
    normals = face_normals(mesh)[faces]  # (k, 3)
    radial = normals[np.abs(normals @ axis - tilt) < _ALIKE]
    angles = np.arctan2(radial @ np.cross(axis, x), radial @ x)
    distinct = np.unique(np.round(angles, 3))
    if len(distinct) == 0 or len(distinct) >= _COARSE:
        return regular, beside
    aligned = np.unique(np.round(np.mod(angles, pitch), 3))
    return np.concatenate([aligned, regular]), [*[None] * len(aligned), *beside]
