"""Gear teeth: flanks that repeat about an axis in equal steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component
from gripwright.domain.shape import BoolArray, IntArray, Segment
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.affordance.axes import Axis, Faces, View, candidate_axes, runs

_TURN = 2.0 * np.pi
_FLANK_TANGENTIAL = 0.55  # least tangential part of a flank's normal: more than that of any polygon's side from six on
_FLANK_AXIAL_MAX = 0.6
_BINS = 4096  # about the axis
_GAP = 0.02  # of the largest radius: flanks farther apart belong to different rims
_BACKWARDS_MAX = 0.1
_FUNDAMENTAL = 0.25  # least coherence of the teeth's own step, as a share of its multiple's
_SLICES = 4  # along it: helical teeth turn from one to the next


class TeethParams(Params):
    """What counts as gear teeth."""

    teeth_min: int = Field(8, ge=3, description="Least number of teeth.")
    teeth_max: int = Field(500, ge=3, description="Largest number of teeth.")
    coherence_min: float = Field(0.6, gt=0, lt=1, description="Least agreement of the flanks with equal steps, 0 to 1.")
    flanks_min: float = Field(0.9, gt=0, le=1, description="Share of the steps that have both flanks of a tooth.")
    depth_min: float = Field(0.35, gt=0, description="Least depth of the teeth, as a share of their pitch.")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Teeth:
    axis: Axis
    faces: BoolArray  # (m,)
    external: bool
    count: int
    root_radius_mm: float
    tip_radius_mm: float
    coherence: float


class TeethDetector:
    """Finds the teeth of spur and helical gears, outer and inner."""

    key: ClassVar[str] = "teeth"
    params_model: ClassVar[type[TeethParams]] = TeethParams

    def __init__(self, params: TeethParams) -> None:
        self._params = params

    def detect(self, component: Component, segments: Sequence[Segment], ctx: RunContext) -> Sequence[Forbidden]:
        """One entry a toothed rim: flanks, tips, roots and the teeth's end faces."""
        faces = Faces.of(component.mesh)
        found: list[_Teeth] = []
        for axis in candidate_axes(component, segments, faces, ctx.rng):
            view = View.about(axis, faces)
            for side in (1.0, -1.0):
                teeth = self._teeth(axis, view, side)
                if teeth is not None and not any((teeth.faces & other.faces).any() for other in found):
                    found.append(teeth)
        return [_forbidden(teeth, self.key) for teeth in found]

    def _teeth(self, axis: Axis, view: View, side: float) -> _Teeth | None:
        """The largest toothed rim whose teeth point away from the axis (side +1) or towards it (−1)."""
        flank = (np.abs(view.tangential) > _FLANK_TANGENTIAL) & (np.abs(view.axial) < _FLANK_AXIAL_MAX)
        rims = [
            self._judged(axis, view, side, rim)
            for ring in runs(view.inner_mm, view.outer_mm, np.flatnonzero(flank), _GAP * float(view.radius_mm.max()))
            for rim in runs(view.low_mm, view.high_mm, ring, _GAP * float(view.radius_mm.max()))
        ]
        return max((rim for rim in rims if rim is not None), key=lambda rim: rim.tip_radius_mm, default=None)

    def _judged(self, axis: Axis, view: View, side: float, rim: IntArray) -> _Teeth | None:
        """Whether flanks (face numbers) that lie together are those of teeth in equal steps all around."""
        if len(rim) < 2 * self._params.teeth_min:
            return None
        count, coherence = self._steps(view, rim)
        low, high = np.percentile(view.radius_mm[rim], [2, 98])
        depth, pitch = float(high - low), _TURN * float(high) / count
        within = (view.radius_mm >= low - depth / 4) & (view.radius_mm <= high + depth / 2)
        bottom, top = view.low_mm[rim].min(), view.high_mm[rim].max()
        slack = 0.02 * max(float(top - bottom), depth)
        within &= (view.low_mm >= bottom - slack) & (view.high_mm <= top + slack)
        # the walls of holes in a circle repeat as well, but half of each looks back to the axis
        back = within & (view.radial * side < -_FLANK_TANGENTIAL)
        backwards = float(view.areas_mm2[back].sum()) / float(view.areas_mm2[rim].sum())
        if (
            count < self._params.teeth_min
            or coherence < self._params.coherence_min
            or depth < self._params.depth_min * pitch
            or backwards > _BACKWARDS_MAX
            or self._filled_steps(view, rim, count) < self._params.flanks_min
        ):
            return None
        return _Teeth(
            axis=axis,
            faces=within,
            external=side > 0,
            count=count,
            root_radius_mm=float(low if side > 0 else high),
            tip_radius_mm=float(high if side > 0 else low),
            coherence=coherence,
        )

    def _steps(self, view: View, rim: IntArray) -> tuple[int, float]:
        """Number of equal steps about the axis that the flanks agree with best, and how well (0 to 1)."""
        along = view.along_mm[rim]
        cell = (view.angle_rad[rim] / _TURN * _BINS).astype(np.int64) % _BINS
        weight = view.areas_mm2[rim] * view.tangential[rim]
        level = np.minimum(((along - along.min()) / max(float(np.ptp(along)), 1e-300) * _SLICES).astype(np.int64), _SLICES - 1)
        spectrum = np.zeros(_BINS // 2 + 1)
        for k in range(_SLICES):
            spectrum += np.abs(np.fft.rfft(np.bincount(cell[level == k], weight[level == k], _BINS)))
        spectrum /= np.abs(weight).sum()
        best = 2 + int(np.argmax(spectrum[2 : self._params.teeth_max + 1]))
        # narrow teeth have stronger harmonics: the lowest number of steps of which the best is a multiple counts
        for steps in range(2, best):
            if best % steps == 0 and spectrum[steps] > _FUNDAMENTAL * spectrum[best]:
                return steps, float(spectrum[steps])
        return best, float(spectrum[best])

    def _filled_steps(self, view: View, rim: IntArray, count: int) -> float:
        """Share of the steps in which there are flanks of both senses."""
        step = (view.angle_rad[rim] / _TURN * count).astype(np.int64) % count
        ahead = view.tangential[rim] > 0
        both = (np.bincount(step[ahead], minlength=count) > 0) & (np.bincount(step[~ahead], minlength=count) > 0)
        return float(both.mean())


def _forbidden(teeth: _Teeth, detector: str) -> Forbidden:
    diameter = 2.0 * teeth.tip_radius_mm
    return Forbidden(
        reason=f"{'gear' if teeth.external else 'ring gear'} teeth ({teeth.count} teeth, tip diameter {diameter:.1f} mm)",
        detector=detector,
        faces=teeth.faces,
        evidence={
            "count": teeth.count,
            "pitch": _TURN * (teeth.root_radius_mm + teeth.tip_radius_mm) / 2.0 / teeth.count,
            "external": teeth.external,
            "root_diameter": 2.0 * teeth.root_radius_mm,
            "tip_diameter": diameter,
            "axis": teeth.axis.direction_C.tolist(),
            "point": teeth.axis.point_C.tolist(),
            "coherence": teeth.coherence,
        },
    )
