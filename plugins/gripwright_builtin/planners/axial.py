"""Centric grasps along the axis of a cylinder, or of whatever else has one (paper, section 5.3)."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.grasp import CENTRIC_3, INTERNAL, Grasp, GripRequirement
from gripwright.domain.shape import AxialPrimitive, FloatArray, Segment
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.measures import face_normals
from gripwright.plugin_api import HandModel, Params, RunContext

_COARSE = 37  # from so many facets about the axis on, any direction is within 5° of a facet's normal
_OFF_BOTTOM_MM = 0.3  # the tips stay above the bottom of a blind bore, also while they let go


class AxialSettings(Params):
    """Resolution of the plan."""

    rotation_step: float = Field(15.0, gt=0, le=120, description="degrees between rotations about the axis")
    depths: int = Field(6, ge=1, le=50, description="number of depths of the tips along the surface")
    contact_reserve: float = Field(0.25, ge=0, le=10, description="mm that the tips reach beyond the least contact")


class AxialPlanner:
    """Aligns the gripper's axis with the primitive's, from either end, at several depths and rotations."""

    key: ClassVar[str] = "axial"
    params_model: ClassVar[type[Params]] = AxialSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({CENTRIC_3})

    def __init__(self, params: AxialSettings) -> None:
        self._params = params

    def plan(
        self, component: Component, segment: Segment, requirement: GripRequirement, hand: HandModel, ctx: RunContext
    ) -> Sequence[Grasp]:
        """Grasps ordered by depth: the shallowest need the shortest fingers."""
        held = requirement.primitive
        if not isinstance(held, AxialPrimitive):
            return []
        x = any_perpendicular(held.axis_C)
        turns, beside = self._rotations(component, segment, held, x, hand.fingers)
        fingers = np.cos(turns)[:, None] * x + np.sin(turns)[:, None] * np.cross(held.axis_C, x)  # (t, 3)
        grasps = []
        off_bottom = _OFF_BOTTOM_MM + ctx.margin_mm if requirement.grip == INTERNAL else None
        for depth, deeper in self._depths(held.height_mm, ctx.min_contact_mm, off_bottom):
            for approach in requirement.approach_C:
                tips = held.center_C + approach * (depth - held.height_mm / 2.0)
                X_CG = pose(fingers, np.cross(approach, fingers), approach, tips)
                for turn, X, stands in zip(turns, X_CG, beside, strict=True):
                    grasps.append(
                        Grasp(
                            X_CG=X,
                            gripper_type=requirement.gripper_type,
                            grip=requirement.grip,
                            opening_width_mm=requirement.opening_width_mm,
                            label=f"along the axis, {depth:.1f} mm deep, turned {np.degrees(turn):.0f}°",
                            leeway=_leeway(stands, deeper),
                        )
                    )
        return grasps

    def _depths(self, height_mm: float, min_contact_mm: float, off_bottom_mm: float | None) -> list[tuple[float, float | None]]:
        """Depths of the tips, ascending, and how much deeper each stands for; within a bore also one that far off its end."""
        least = min(height_mm, min_contact_mm + self._params.contact_reserve)
        steps = np.array([least, least + 1.0, least + 2.5])  # past a chamfer or a fillet
        deep = np.array([] if off_bottom_mm is None else [height_mm - off_bottom_mm])
        regular = np.round(np.linspace(least, height_mm, self._params.depths), 6)
        chosen = np.concatenate([steps[steps <= height_mm], deep[deep >= min(min_contact_mm, least)], regular])
        ends = np.append(regular[1:], height_mm)
        deeper = {low: high - low for low, high in zip(regular.tolist(), ends.tolist(), strict=True) if high > low}
        return [(depth, deeper.get(depth)) for depth in np.unique(np.round(chosen, 6)).tolist()]

    def _rotations(
        self, component: Component, segment: Segment, held: AxialPrimitive, x: FloatArray, fingers: int
    ) -> tuple[FloatArray, list[float | None]]:
        """Rotations of finger 1 about the axis, [0, 2π/fingers), and how far each stands for those beside it.

        Regular ones, and on a coarse mesh those that meet facets.
        """
        pitch, step = 2.0 * np.pi / fingers, float(np.radians(self._params.rotation_step))
        regular = np.arange(0.0, pitch - 1e-9, step)
        beside: list[float | None] = [step / 2.0] * len(regular)
        normals = face_normals(component.mesh)[segment.faces]  # (k, 3)
        radial = normals[np.abs(normals @ held.axis_C) < 0.1]
        angles = np.arctan2(radial @ np.cross(held.axis_C, x), radial @ x)
        distinct = np.unique(np.round(angles, 3))
        if len(distinct) == 0 or len(distinct) >= _COARSE:
            return regular, beside
        aligned = np.unique(np.round(np.mod(angles, pitch), 3))
        return np.concatenate([aligned, regular]), [*[None] * len(aligned), *beside]


def _leeway(beside_rad: float | None, deeper_mm: float | None) -> FloatArray | None:
    """The grasps that one with such neighbours stands for: about the axis, and along it."""
    if beside_rad is None or deeper_mm is None:
        return None
    return np.array([[0.0, 0.0], [-beside_rad, beside_rad], [0.0, 0.0], [0.0, deeper_mm]])
