"""Screw threads: flanks that repeat along and about an axis as a helix does."""

from collections.abc import Iterator, Sequence
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
_STARTS = (1, 2, 3)
_FLANK_AXIAL = 0.2  # least axial part of a flank's normal
_FLANK_RADIAL = 0.1  # least radial part
_GAP = 0.05  # of the largest radius: flanks farther apart belong to different threads
_SECTORS = 8  # about the axis
_BINS = 4096  # along the axis
_PEAKS = 3  # of each spectrum


class ThreadParams(Params):
    """What counts as a screw thread."""

    turns_min: float = Field(2.0, ge=1, description="Least number of turns.")
    depth_min: float = Field(0.1, gt=0, description="Least depth of the flanks, as a share of the pitch.")
    depth_max: float = Field(1.2, gt=0, description="Largest depth of the flanks, as a share of the pitch.")
    around_min: float = Field(0.8, gt=0, le=1, description="Least share of the way around the axis, turn by turn, with flanks.")
    coherence_min: float = Field(0.5, gt=0, lt=1, description="Least agreement of the flanks with one helix, 0 to 1.")
    lead_tolerance: float = Field(
        0.35, gt=0, lt=1, description="Largest deviation of the flanks' slope from the helix, as a share."
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Thread:
    axis: Axis
    faces: BoolArray  # (m,)
    external: bool
    lead_mm: float  # signed: positive right-handed
    starts: int
    turns: float
    coherence: float
    radius_min_mm: float
    radius_max_mm: float


class ThreadDetector:
    """Finds screw threads, outside and in bores, of any hand and up to three starts."""

    key: ClassVar[str] = "threads"
    params_model: ClassVar[type[ThreadParams]] = ThreadParams

    def __init__(self, params: ThreadParams) -> None:
        self._params = params

    def detect(self, component: Component, segments: Sequence[Segment], ctx: RunContext) -> Sequence[Forbidden]:
        """One entry a thread: crests, flanks and roots."""
        faces = Faces.of(component.mesh)
        found: list[_Thread] = []
        for axis in candidate_axes(component, segments, faces, ctx.rng):
            view = View.about(axis, faces)
            for side in (1.0, -1.0):
                thread = self._thread(axis, view, side)
                if thread is not None and not any((thread.faces & other.faces).any() for other in found):
                    found.append(thread)
        return [_forbidden(thread, self.key) for thread in found]

    def _thread(self, axis: Axis, view: View, side: float) -> _Thread | None:
        """The most coherent helix among the faces that look away from the axis (side +1) or towards it (−1)."""
        flank = (view.radial * side > _FLANK_RADIAL) & (np.abs(view.axial) > _FLANK_AXIAL)
        if not flank.any():
            return None
        threads = [
            self._judged(axis, view, side, ring, starts, wave)
            for ring in runs(view.inner_mm, view.outer_mm, np.flatnonzero(flank), _GAP * float(view.radius_mm[flank].max()))
            for starts, wave in _waves(view, ring)
        ]
        return max((t for t in threads if t is not None), key=lambda t: t.coherence * t.turns, default=None)

    def _judged(self, axis: Axis, view: View, side: float, flank: IntArray, starts: int, wave: float) -> _Thread | None:
        """Whether the flanks follow a helix of `starts` starts with `wave` radians a mm along the axis."""
        if len(flank) < 8:
            return None
        pitch = _TURN / abs(wave)
        weight = view.areas_mm2[flank] * view.axial[flank]
        phase = wave * view.along_mm[flank] - starts * view.angle_rad[flank]
        rows = ((view.along_mm[flank] - view.along_mm[flank].min()) / pitch).astype(np.int64)  # one a pitch
        total = np.bincount(rows, np.abs(weight))
        wave_sum = np.bincount(rows, weight * np.cos(phase)) + 1j * np.bincount(rows, weight * np.sin(phase))
        coherent = np.abs(wave_sum) / np.maximum(total, 1e-300) >= self._params.coherence_min
        first, last = _longest_run(coherent & (total > 0.25 * np.median(total[coherent])) if coherent.any() else coherent)
        if (last - first) < self._params.turns_min:
            return None
        inside = (rows >= first) & (rows < last)
        sectors = (view.angle_rad[flank][inside] / _TURN * _SECTORS).astype(np.int64) % _SECTORS
        if len(np.unique(rows[inside] * _SECTORS + sectors)) < self._params.around_min * _SECTORS * (last - first):
            return None
        coherence = abs((weight * np.exp(1j * phase))[inside].sum()) / np.abs(weight[inside]).sum()
        lead = starts * _TURN / wave
        if coherence < self._params.coherence_min:
            return None
        turning = view.areas_mm2[flank] * view.tangential[flank] * view.radius_mm[flank] * np.sign(view.axial[flank])
        slope = -_TURN * float(turning[inside].sum() / np.abs(weight[inside]).sum())  # mm a turn, as the normals say
        if abs(slope - lead) > self._params.lead_tolerance * abs(lead):
            return None
        flanks = flank[inside]
        low, high = np.percentile(view.radius_mm[flanks], [2, 98])
        depth = high - low
        if not self._params.depth_min * pitch <= depth <= self._params.depth_max * pitch:
            return None
        bottom, top = view.low_mm[flanks].min(), view.high_mm[flanks].max()
        faces = (view.along_mm >= bottom - pitch) & (view.along_mm <= top + pitch)  # with its run-out
        faces &= (view.radius_mm >= low - depth / 2) & (view.radius_mm <= high + depth / 2) & (view.radial * side > 0)
        return _Thread(
            axis=axis,
            faces=faces,
            external=side > 0,
            lead_mm=lead,
            starts=starts,
            turns=float(top - bottom) / abs(lead),
            coherence=float(coherence),
            radius_min_mm=float(low),
            radius_max_mm=float(high),
        )


def _waves(view: View, flank: IntArray) -> Iterator[tuple[int, float]]:
    """Strongest waves along the axis of each angular order, (order, signed radians a mm)."""
    along, angle = view.along_mm[flank], view.angle_rad[flank]
    weight = view.areas_mm2[flank] * view.axial[flank]
    low, length = float(along.min()), float(np.ptp(along))
    if not length > 0:
        return
    cell = np.minimum(((along - low) / length * _BINS).astype(np.int64), _BINS - 1)
    for starts in _STARTS:
        turned = weight * np.exp(1j * starts * angle)
        signal = np.bincount(cell, turned.real, _BINS) + 1j * np.bincount(cell, turned.imag, _BINS)
        spectrum = np.abs(np.fft.fft(signal, 4 * _BINS))
        frequency = np.fft.fftfreq(4 * _BINS, length / _BINS)  # periods a mm
        spectrum[(np.abs(frequency) < 2.0 / length) | (np.abs(frequency) > 0.1 * _BINS / length)] = 0.0
        peak = (spectrum > np.roll(spectrum, 1)) & (spectrum >= np.roll(spectrum, -1))
        for k in np.argsort(np.where(peak, -spectrum, 0.0), kind="stable")[:_PEAKS]:
            if spectrum[k] > 0:
                before, at, after = spectrum[k - 1], spectrum[k], spectrum[(k + 1) % len(spectrum)]
                aside = (before - after) / (2.0 * (before - 2.0 * at + after))  # vertex of the parabola through the three
                yield starts, float(_TURN * (frequency[k] + aside / (4.0 * length)))


def _longest_run(flags: BoolArray) -> tuple[int, int]:
    """First and one past the last index of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    if not len(edges):
        return 0, 0
    starts, ends = edges[0::2], edges[1::2]
    k = int(np.argmax(ends - starts))
    return int(starts[k]), int(ends[k])


def _forbidden(thread: _Thread, detector: str) -> Forbidden:
    diameter = 2.0 * (thread.radius_max_mm if thread.external else thread.radius_min_mm)
    where = "external" if thread.external else "internal"
    return Forbidden(
        reason=f"screw thread ({where}, diameter {diameter:.1f} mm, pitch {abs(thread.lead_mm) / thread.starts:.2f} mm)",
        detector=detector,
        faces=thread.faces,
        evidence={
            "pitch": abs(thread.lead_mm) / thread.starts,
            "starts": thread.starts,
            "hand": "right" if thread.lead_mm > 0 else "left",
            "turns": thread.turns,
            "external": thread.external,
            "diameter_min": 2.0 * thread.radius_min_mm,
            "diameter_max": 2.0 * thread.radius_max_mm,
            "axis": thread.axis.direction_C.tolist(),
            "point": thread.axis.point_C.tolist(),
            "coherence": thread.coherence,
        },
    )
