"""Which sizes of face a primitive has room for, and from where: what both rules ask."""

from collections.abc import Sequence

import numpy as np

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE, GripRequirement
from gripwright.domain.shape import Box, Cylinder, FloatArray, Primitive

_NO_TYPE = "no-type"


def face_requirements(
    fit: Primitive, gripper_type: str, sizes_mm: Sequence[float], rule: str
) -> Sequence[GripRequirement] | Rejection:
    """One requirement for each size that the primitive's flat faces have room for, the largest first.

    Of a primitive that is neither a box nor a cylinder nothing is known: the planner looks for flat faces on the segment itself.
    """
    if isinstance(fit, Cylinder) and fit.internal:
        return Rejection(_NO_TYPE, f"the cylinder of diameter {2.0 * fit.radius_mm:.2f} mm is a bore, without a flat face")
    room_mm, approach_C = _faces(fit)
    fitting = sorted((size for size in sizes_mm if size <= room_mm), reverse=True)
    if not fitting:
        return Rejection(
            _NO_TYPE, f"the flat faces are {room_mm:.1f} mm wide at most, the smallest {gripper_type} has {min(sizes_mm):g} mm"
        )
    return [
        GripRequirement(
            gripper_type=gripper_type,
            opening_width_mm=size,
            grip=SURFACE,
            approach_C=approach_C,
            grip_axes_C=np.zeros((0, 3)),
            primitive=fit,
            rule=rule,
        )
        for size in fitting
    ]


def _faces(fit: Primitive) -> tuple[float, FloatArray]:
    """The widest face's lesser side, and the directions (a, 3) from which the gripper may come; none: any."""
    if isinstance(fit, Box):
        axes = fit.X_CB[:3, :3].T
        return float(np.sort(fit.extents_mm)[1]), np.concatenate([-axes, axes])
    if isinstance(fit, Cylinder):
        return 2.0 * fit.radius_mm, np.stack([-fit.axis_C, fit.axis_C])
    return np.inf, np.zeros((0, 3))
