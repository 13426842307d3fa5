"""Plates made by code, and what holds them. Lengths in mm."""

from collections.abc import Sequence
from typing import Any

import manifold3d
import numpy as np

from gripwright.domain.assembly import IDENTITY, Component
from gripwright.domain.grasp import SURFACE, Grasp, GripRequirement
from gripwright.domain.holding import Load
from gripwright.domain.shape import Box, FloatArray, Mesh, Segment
from gripwright.geometry.measures import face_areas_mm2
from gripwright_vacuum.gripper_types import VACUUM_1

SIZE_MM = (120.0, 80.0, 6.0)
DOWN = np.array([0.0, 0.0, -1.0])


def plate(*holes: tuple[float, float, float], thickness_mm: float = SIZE_MM[2], **figures: Any) -> Component:
    """A plate centred on the origin, its top at z = 0; each hole is (x, y, radius), through."""
    solid = manifold3d.Manifold.cube((*SIZE_MM[:2], thickness_mm)).translate(
        (-SIZE_MM[0] / 2.0, -SIZE_MM[1] / 2.0, -thickness_mm)
    )
    for x, y, radius in holes:
        solid -= manifold3d.Manifold.cylinder(4.0 * thickness_mm, radius, radius, 48).translate((x, y, -2.0 * thickness_mm))
    found = solid.to_mesh64()
    mesh = Mesh(vertices_mm=np.array(found.vert_properties[:, :3]), faces=np.array(found.tri_verts, dtype=np.int64))
    return Component(id="plate", mesh=mesh, X_PC=IDENTITY, **figures)


def whole(component: Component) -> Segment:
    areas = face_areas_mm2(component.mesh)
    return Segment(id=0, faces=np.arange(len(areas)), area_mm2=float(areas.sum()), hull_volume_mm3=float(np.prod(SIZE_MM)))


def asked(width_mm: float, gripper_type: str = VACUUM_1) -> GripRequirement:
    """From above alone."""
    X = np.eye(4)
    X[2, 3] = -SIZE_MM[2] / 2.0
    box = Box(X_CB=X, extents_mm=np.array(SIZE_MM), filled=np.ones(6), filled_min=0.5, rms_mm=0.0)
    return GripRequirement(
        gripper_type=gripper_type,
        opening_width_mm=width_mm,
        grip=SURFACE,
        approach_C=DOWN[None],
        grip_axes_C=np.zeros((0, 3)),
        primitive=box,
        rule="vacuum_face",
    )


def on_top(
    x: float = 0.0, y: float = 0.0, *, width_mm: float = 32.0, off_mm: float = 0.0005, gripper_type: str = VACUUM_1
) -> Grasp:
    """Held from above at a place of the top."""
    X_CG = np.diag([1.0, -1.0, -1.0, 1.0])
    X_CG[:3, 3] = x, y, off_mm
    return Grasp(X_CG=X_CG, gripper_type=gripper_type, grip=SURFACE, opening_width_mm=width_mm)


def hanging(mass_kg: float, *, centroid: Sequence[float] = (0.0, 0.0, 0.0), force_N: float = 0.0) -> Load:
    """Carried upright and set down."""
    centre: FloatArray = np.array(centroid, dtype=float)
    return Load(mass_kg=mass_kg, force_N=force_N, centroid_C=centre, gravity_C=DOWN[None], insertion_C=np.stack([centre, DOWN]))
