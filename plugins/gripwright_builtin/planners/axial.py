"""Centric grasps along the axis of a cylinder, or of whatever else has one (paper, section 5.3), or of a square box."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, INTERNAL, Grasp, GripRequirement
from gripwright.domain.shape import AxialPrimitive, Box, FloatArray, Segment
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.turns import turns_about
from gripwright.plugin_api import HandModel, Params, RunContext

_OFF_BOTTOM_MM = 0.3  # the tips stay above the bottom of a blind bore, also while they let go


class AxialSettings(Params):
    """Resolution of the plan."""

    rotation_step: float = Field(15.0, gt=0, le=120, description="degrees between rotations about the axis")
    depths: int = Field(6, ge=1, le=50, description="number of depths of the tips along the surface")
    contact_reserve: float = Field(0.25, ge=0, le=10, description="mm that the tips reach beyond the least contact")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Column:
    """What is held around its axis, and the rotations of finger 1 about it at which the fingers meet it."""

    center_C: FloatArray  # (3,) the middle of the axis
    axis_C: FloatArray  # (3,) unit
    height_mm: float
    x_C: FloatArray  # (3,) unit, across the axis: from here finger 1 is turned
    turns_rad: FloatArray  # (t,)
    beside_rad: list[float | None]  # of each how far it stands for those beside it; None: for none, nor for those deeper


class AxialPlanner:
    """Aligns the gripper's axis with the primitive's, from either end, at several depths and rotations.

    Four fingers stand square on the sides of a box.
    """

    key: ClassVar[str] = "axial"
    params_model: ClassVar[type[Params]] = AxialSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({CENTRIC_3, CENTRIC_4})

    def __init__(self, params: AxialSettings) -> None:
        self._params = params

    def plan(
        self, component: Component, segment: Segment, requirement: GripRequirement, hand: HandModel, ctx: RunContext
    ) -> Sequence[Grasp]:
        """Grasps ordered by depth: the shallowest need the shortest fingers."""
        column = self._column(component, segment, requirement, hand.fingers)
        if column is None:
            return []
        x, turns = column.x_C, column.turns_rad
        fingers = np.cos(turns)[:, None] * x + np.sin(turns)[:, None] * np.cross(column.axis_C, x)  # (t, 3)
        grasps = []
        off_bottom = _OFF_BOTTOM_MM + ctx.margin_mm if requirement.grip == INTERNAL else None
        for depth, deeper in self._depths(column.height_mm, ctx.min_contact_mm, off_bottom):
            for approach in requirement.approach_C:
                tips = column.center_C + approach * (depth - column.height_mm / 2.0)
                X_CG = pose(fingers, np.cross(approach, fingers), approach, tips)
                for turn, X, stands in zip(turns, X_CG, column.beside_rad, strict=True):
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

    def _column(self, component: Component, segment: Segment, requirement: GripRequirement, fingers: int) -> _Column | None:
        """What has an axis, or the box along the axis that is approached; None: there is nothing for this planner."""
        held = requirement.primitive
        if requirement.taper_rad:
            return None
        if isinstance(held, AxialPrimitive):
            x = any_perpendicular(held.axis_C)
            step = float(np.radians(self._params.rotation_step))
            turns, beside = turns_about(component.mesh, segment.faces, held.axis_C, x, fingers, step)
            return _Column(
                center_C=held.center_C, axis_C=held.axis_C, height_mm=held.height_mm, x_C=x, turns_rad=turns, beside_rad=beside
            )
        if not isinstance(held, Box) or fingers != 4 or len(requirement.approach_C) == 0:
            return None
        k = int(np.abs(requirement.approach_C[0] @ held.X_CB[:3, :3]).argmax())
        return _Column(
            center_C=held.X_CB[:3, 3],
            axis_C=held.X_CB[:3, k],
            height_mm=float(held.extents_mm[k]),
            x_C=held.X_CB[:3, (k + 1) % 3],
            turns_rad=np.zeros(1),
            beside_rad=[0.0],
        )

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


def _leeway(beside_rad: float | None, deeper_mm: float | None) -> FloatArray | None:
    """The grasps that one with such neighbours stands for: about the axis, and along it."""
    if beside_rad is None or deeper_mm is None:
        return None
    return np.array([[0.0, 0.0], [-beside_rad, beside_rad], [0.0, 0.0], [0.0, deeper_mm]])
