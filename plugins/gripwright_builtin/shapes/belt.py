"""Where straight fingers touch a curved surface: along a low cylinder, which planners know. Lengths in mm."""

import numpy as np

from gripwright.domain.shape import Cylinder, FloatArray

GAP_MM = 0.045  # a straight finger counts as touching where it is not farther off (the contract's touch, less a reserve)


def touched_mm(radius_mm: float) -> float:
    """Along how much of a surface of that radius a straight finger that is tangent to it touches."""
    return 2.0 * float(np.sqrt(2.0 * radius_mm * GAP_MM))


def belt(
    center_C: FloatArray, axis_C: FloatArray, radius_mm: float, height_mm: float, *, internal: bool, rms_mm: float
) -> Cylinder:
    """The cylinder that fingers touch as they touch the surface."""
    return Cylinder(
        center_C=center_C,
        axis_C=axis_C,
        radius_mm=radius_mm,
        height_mm=height_mm,
        internal=internal,
        arc_rad=2.0 * np.pi,
        rms_mm=rms_mm,
        surface_filled=True,
    )
