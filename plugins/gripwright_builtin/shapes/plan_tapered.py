"""Grasps of tapered and V tips along the axis of a cone, a pyramid or a cylinder."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.grasp import CENTRIC_3, CENTRIC_4, PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.shape import Cylinder, FloatArray, Primitive, Segment
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import VTip
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.turns import turns_about
from gripwright.plugin_api import HandModel, Params, RunContext
from gripwright_builtin.shapes.cone import Cone
from gripwright_builtin.shapes.pyramid import Pyramid

_Turns = list[tuple[FloatArray, float, float | None]]


class TaperedSettings(Params):
    """Resolution of the plan."""

    rotation_step: float = Field(
        15.0, gt=0, le=120, description="degrees between rotations about the axis of a cone or a cylinder"
    )
    depths: int = Field(6, ge=1, le=50, description="number of depths of the tips along the surface")
    contact_reserve: float = Field(0.25, ge=0, le=10, description="mm that the tips reach beyond the least contact")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Flank:
    """The surface along the gripper's approach: half its width at the end that the tips pass first, and how that grows."""

    entry_C: FloatArray  # (3,) where the axis meets that end
    half_mm: float
    growth: float  # of half the width, a mm of depth
    height_mm: float


class TaperedPlanner:
    """Aligns the gripper's axis with that of a cone, pyramid or cylinder, at several depths, as wide open as the tips ask there.

    Grippers are turned about what is round in steps; on a pyramid every finger stands in the middle of a side.
    """

    key: ClassVar[str] = "tapered"
    params_model: ClassVar[type[Params]] = TaperedSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({CENTRIC_3, CENTRIC_4, PARALLEL_2})

    def __init__(self, params: TaperedSettings) -> None:
        self._params = params

    def plan(
        self, component: Component, segment: Segment, requirement: GripRequirement, hand: HandModel, ctx: RunContext
    ) -> Sequence[Grasp]:
        """Grasps ordered by depth; none where neither a taper nor a V is asked for."""
        held, tip = requirement.primitive, _tip(requirement)
        if tip is None or not isinstance(held, Cone | Pyramid | Cylinder):
            return []
        turns = self._turns(component, segment, requirement, hand.fingers)
        floor_mm = hand.opening_floor_mm(requirement.grip)
        return [
            Grasp(
                X_CG=pose(x, np.cross(approach, x), approach, flank.entry_C + approach * depth),
                gripper_type=requirement.gripper_type,
                grip=requirement.grip,
                opening_width_mm=opening,
                contact_offset_mm=_contact_offset_mm(flank, tip, depth, opening),
                label=f"along the axis, {depth:.1f} mm deep, turned {np.degrees(turn):.0f}°",
                leeway=None if beside is None else np.array([[0.0, 0.0], [-beside, beside], [0.0, 0.0], [0.0, 0.0]]),
            )
            for approach in requirement.approach_C
            for flank in [_flank(held, approach)]
            for depth, opening in self._depths(flank, tip, ctx.min_contact_mm)
            for x, turn, beside in turns
            if opening > floor_mm
        ]

    def _turns(self, component: Component, segment: Segment, requirement: GripRequirement, fingers: int) -> _Turns:
        """Directions of finger 1, the angle of each, and how far it stands for those beside it."""
        held = requirement.primitive
        if isinstance(held, Pyramid):
            axes = requirement.grip_axes_C if len(requirement.grip_axes_C) else _first_sides(held, fingers)
            return [(x, float(np.arctan2(held.axis_C @ np.cross(held.side_C, x), held.side_C @ x)), None) for x in axes]
        assert isinstance(held, Cone | Cylinder)
        x, step = any_perpendicular(held.axis_C), float(np.radians(self._params.rotation_step))
        tilt = float(np.sin(held.half_angle_rad)) if isinstance(held, Cone) else 0.0
        turns, beside = turns_about(component.mesh, segment.faces, held.axis_C, x, fingers, step, tilt)
        if requirement.vee is not None:  # a flank meets a facet, not the middle of the V
            turns = turns - requirement.vee.turn_rad
        y = np.cross(held.axis_C, x)
        return [(np.cos(t) * x + np.sin(t) * y, t, b) for t, b in zip(turns.tolist(), beside, strict=True)]

    def _depths(self, flank: _Flank, tip: Taper | VTip, min_contact_mm: float) -> Iterator[tuple[float, float]]:
        """Depths of the tips, ascending, and the opening at which they touch.

        They go deeper than they are high only where what they have passed by is narrower.
        """
        deepest = min(flank.height_mm, tip.height_mm) if flank.growth < 0.0 else flank.height_mm
        least = min(deepest, min_contact_mm + self._params.contact_reserve)
        slope = -(tip.stem_mm - tip.tip_mm) / tip.height_mm  # of the gripping surface, as of the flank
        middle, deep = _in_v(flank, tip)
        for depth in np.unique(np.round(np.linspace(least, deepest, self._params.depths), 6)).tolist():
            along = min(depth, tip.height_mm)  # as high stand tip and flank side by side
            at_end = middle.half_mm + middle.growth * depth - tip.tip_mm
            yield depth, 2.0 * max(at_end, at_end + along * (slope - middle.growth)) - 2.0 * deep


def _tip(requirement: GripRequirement) -> Taper | VTip | None:
    """What the requirement asks of tips; None: they are straight."""
    if requirement.vee is not None:
        return VTip(vee=requirement.vee, taper_rad=requirement.taper_rad)
    return Taper(angle_rad=requirement.taper_rad) if requirement.taper_rad else None


def _in_v(flank: _Flank, tip: Taper | VTip) -> tuple[_Flank, float]:
    """Where the flats of a V that touches a round flank meet, as a flank; and how far behind the V's edges that is."""
    if isinstance(tip, Taper):
        return flank, 0.0
    across = float(np.cos(tip.vee.turn_rad))
    return replace(flank, half_mm=flank.half_mm / across, growth=flank.growth / across), tip.vee.depth_mm


def _contact_offset_mm(flank: _Flank, tip: Taper | VTip, depth_mm: float, opening_mm: float) -> float:
    """How far outside of the plane x = 0 the nearest contact is."""
    if isinstance(tip, Taper):
        return max(tip.tip_mm - depth_mm * tip.depth_mm / tip.height_mm, 0.0)
    along = np.array([0.0, min(depth_mm, tip.height_mm)])  # back from the tip's end
    touching = (flank.half_mm + flank.growth * (depth_mm - along)) * np.cos(tip.vee.turn_rad)
    return max(float(touching.min()) - opening_mm / 2.0, 0.0)


def _first_sides(held: Pyramid, fingers: int) -> FloatArray:
    """Where finger 1 of a centric gripper may stand: (k, 3), so that every finger has a filled side."""
    emptiest = held.filled.reshape(fingers, -1).min(axis=0)
    return held.sides_C[np.flatnonzero(emptiest >= held.filled_min)]


def _flank(held: Primitive, approach_C: FloatArray) -> _Flank:
    """The surface as it is met along a direction of its axis."""
    if isinstance(held, Cylinder):
        wide = narrow = held.radius_mm
    elif isinstance(held, Cone):
        wide, narrow = held.radius_mm, held.radius_top_mm
    else:
        assert isinstance(held, Pyramid)
        wide, narrow = held.across_flats_mm / 2.0, held.across_flats_top_mm / 2.0
    first, last = (wide, narrow) if held.axis_C @ approach_C > 0.0 else (narrow, wide)
    return _Flank(
        entry_C=held.center_C - approach_C * held.height_mm / 2.0,
        half_mm=first,
        growth=(last - first) / held.height_mm,
        height_mm=held.height_mm,
    )
