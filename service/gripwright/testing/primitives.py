"""Primitives and grip requirements as fitters and rules give them, for the plug-ins that come after these."""

import numpy as np

from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, PARALLEL_2, SURFACE, GripRequirement
from gripwright.domain.shape import Box, Cylinder, FloatArray, Primitive
from gripwright.domain.v_tip import Vee
from gripwright.geometry.drawn import primitive_mesh
from gripwright.geometry.frames import transform
from gripwright.testing.samples import TILTED

_Z = np.array([0.0, 0.0, 1.0])
_NEAR, _SLENDER = 100.0, 50.0


def cylinder(X_CB: FloatArray, *, internal: bool = False) -> Cylinder:
    """Radius 10, 20 high, from the origin of B along its z: the lower part of the stepped shaft."""
    return Cylinder(
        center_C=transform(X_CB, 10.0 * _Z),
        axis_C=X_CB[:3, 2].copy(),
        radius_mm=10.0,
        height_mm=20.0,
        internal=internal,
        arc_rad=2.0 * np.pi,
        rms_mm=0.0,
        surface_filled=True,
    )


def box(X_CB: FloatArray) -> Box:
    """40 × 30 × 12 from the origin of B, all faces filled: the box of the box with a boss."""
    X = X_CB.copy()
    X[:3, 3] = transform(X_CB, np.array([20.0, 15.0, 6.0]))
    return Box(X_CB=X, extents_mm=np.array([40.0, 30.0, 12.0]), filled=np.ones(6), filled_min=0.5, rms_mm=0.0)


def sample_primitives() -> dict[str, Primitive]:
    """Name → primitive, upright and tilted."""
    found: dict[str, Primitive] = {}
    for name, X in (("upright", np.eye(4)), ("tilted", TILTED)):
        found[f"{name} cylinder"] = cylinder(X)
        found[f"{name} bore"] = cylinder(X, internal=True)
        found[f"{name} box"] = box(X)
    return found


def widths_mm(primitive: Primitive) -> tuple[float, float]:
    """The least and the largest opening that may hold a primitive: a share of its extent, and all of it.

    One that does not say what it looks like may be flat or long.
    """
    if isinstance(primitive, Cylinder):
        extent = float(np.hypot(2.0 * primitive.radius_mm, primitive.height_mm))
    elif isinstance(primitive, Box):
        extent = float(np.linalg.norm(primitive.extents_mm))
    elif (drawn := primitive_mesh(primitive)) is not None:
        extent = float(np.linalg.norm(np.ptp(drawn.vertices_mm, axis=0)))
    else:
        cube = float(np.cbrt(primitive.volume_mm3))
        return cube / _SLENDER, cube * _SLENDER
    return extent / _NEAR, extent * 1.001


def centric_requirement(X_CB: FloatArray, gripper_type: str = CENTRIC_3) -> GripRequirement:
    """Hold the cylinder from outside, along its axis."""
    held = cylinder(X_CB)
    return GripRequirement(
        gripper_type=gripper_type,
        opening_width_mm=20.0,
        grip=EXTERNAL,
        approach_C=np.stack([-held.axis_C, held.axis_C]),
        grip_axes_C=np.zeros((0, 3)),
        primitive=held,
        rule="sample",
    )


def parallel_requirement(X_CB: FloatArray, gripper_type: str = PARALLEL_2) -> GripRequirement:
    """Hold the box across its extent of 30."""
    return GripRequirement(
        gripper_type=gripper_type,
        opening_width_mm=30.0,
        grip=EXTERNAL,
        approach_C=np.zeros((0, 3)),
        grip_axes_C=X_CB[None, :3, 1].copy(),
        primitive=box(X_CB),
        rule="sample",
    )


def v_requirement(X_CB: FloatArray) -> GripRequirement:
    """Hold the cylinder along its axis by two fingers with a V."""
    held, vee = cylinder(X_CB), Vee(angle_rad=float(np.radians(120.0)), depth_mm=4.0)
    return GripRequirement(
        gripper_type=PARALLEL_2,
        opening_width_mm=vee.opening_mm(held.radius_mm),
        grip=EXTERNAL,
        approach_C=np.stack([-held.axis_C, held.axis_C]),
        grip_axes_C=np.zeros((0, 3)),
        primitive=held,
        rule="sample",
        vee=vee,
    )


def face_requirement(X_CB: FloatArray, gripper_type: str) -> GripRequirement:
    """Hold the box by a face of 16 mm from below, where it is flat."""
    return GripRequirement(
        gripper_type=gripper_type,
        opening_width_mm=16.0,
        grip=SURFACE,
        approach_C=X_CB[None, :3, 2].copy(),
        grip_axes_C=np.zeros((0, 3)),
        primitive=box(X_CB),
        rule="sample",
    )
