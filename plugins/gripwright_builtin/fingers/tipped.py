"""Stems whose tips are cut from a rectangle: tapered ones, and those with a V."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gripwright.domain.shape import FloatArray
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import VTip
from gripwright_builtin.fingers.stem import CutStem, PadStrip, Stem

if TYPE_CHECKING:  # the CAD kernel takes most of a second, and most designs that are repeated make no finger
    from gripwright.geometry import brep


@dataclass(frozen=True, slots=True, kw_only=True)
class TaperedStem(CutStem):
    """A flat stem whose tip has an inclined gripping surface; the pad covers that alone, up to a shoulder of the stem."""

    taper: Taper

    @property
    def wall_mm(self) -> float:
        """At the shoulder."""
        return self.flat.thickness_mm - self.taper.depth_mm - self._pad_x_mm

    def solid(self, length_mm: float) -> "brep.Shape":
        """The flat stem without what lies before the inclined plane, and before the stem behind it."""
        from gripwright.geometry import brep

        tip, stem, back = self.taper.tip_mm, self.taper.stem_mm, -self.taper.height_mm
        before = np.array([[tip, 0.0], [tip, 1.0], [-1.0, 1.0], [-1.0, -length_mm], [stem, -length_mm], [stem, back]])
        y = self.flat.width_mm / 2.0
        return brep.cut(self.flat.solid(length_mm), [brep.prism_y(before, -y - 1.0, y + 1.0)])

    def pad(self, length_mm: float) -> PadStrip:
        """A strip on the inclined plane, bevelled at both ends."""
        from gripwright.geometry import brep

        tip, stem, back = self.taper.tip_mm, self.taper.stem_mm, -self.taper.height_mm
        layer = np.array([[tip, 0.0], [stem, back], [stem + self._pad_x_mm, back], [tip + self._pad_x_mm, 0.0]])
        y = self.flat.width_mm / 2.0
        return PadStrip(
            solid=brep.prism_y(layer, -y, y), size_mm=(self.flat.pad_mm, self.flat.width_mm, round(self.taper.slant_mm, 6))
        )

    @property
    def _pad_x_mm(self) -> float:
        """Extent of the pad along x."""
        return self.flat.pad_mm * self.taper.slant_mm / self.taper.height_mm


@dataclass(frozen=True, slots=True, kw_only=True)
class VStem(CutStem):
    """A flat stem whose tip has a V; the pad lines both flanks, folded at the bottom of the V, up to a shoulder of the stem."""

    tip: VTip  # as wide as the flat stem

    @property
    def wall_mm(self) -> float:
        """Where the V is deepest."""
        return self.flat.thickness_mm - self.tip.depth_mm - self._pad_x_mm

    def solid(self, length_mm: float) -> "brep.Shape":
        """The flat stem without what lies before the V, and before the stem behind it."""
        from gripwright.geometry import brep

        y, back = self.flat.width_mm / 2.0 + 1.0, -self.tip.height_mm
        tools = [self._before_flanks()]
        if length_mm > self.tip.height_mm:
            tools.append(brep.box((-2.0 - self.tip.depth_mm, -y, -length_mm), (self.tip.back_mm, y, back)))
        return brep.cut(self.flat.solid(length_mm), tools)

    def pad(self, length_mm: float) -> PadStrip:
        """A strip of even thickness on both flanks, level with tip and sides, bevelled at its ends where the V is tapered."""
        from gripwright.geometry import brep

        front = self.tip.section_mm(0.0)
        layer = np.concatenate([front, front[::-1] + np.array([self._pad_x_mm, 0.0])])
        across = self.flat.width_mm / float(np.cos(self.tip.vee.turn_rad))
        return PadStrip(
            solid=brep.prism_along(layer, 0.0, self._back.tolist()),
            size_mm=(self.flat.pad_mm, round(across, 6), round(self.tip.slant_mm, 6)),
        )

    def _before_flanks(self) -> "brep.Shape":
        """The room before the V, which reaches beyond the tip's end and its sides."""
        from gripwright.geometry import brep

        (edge, half), (bottom, _) = self.tip.section_mm(0.0)[2], self.tip.section_mm(0.0)[1]
        wider = 1.0 + 1.0 / half  # beyond the edges along the flanks
        x_edge, y_edge = bottom + (edge - bottom) * wider, half * wider
        far = -2.0 - self.tip.depth_mm
        room = np.array([[bottom, 0.0], [x_edge, y_edge], [far, y_edge], [far, -y_edge], [x_edge, -y_edge]])
        beyond = 1.0 / self.tip.height_mm  # of the way, before the tip's end
        return brep.prism_along(room - beyond * self._back[:2], -beyond * self._back[2], (self._back * (1.0 + beyond)).tolist())

    @property
    def _back(self) -> FloatArray:
        """The way along the bottom of the V from the tip's end to the shoulder, (3,)."""
        return np.array([self.tip.stem_mm - self.tip.tip_mm, 0.0, -self.tip.height_mm])

    @property
    def _pad_x_mm(self) -> float:
        """Extent of the pad along x."""
        return float(self.flat.pad_mm / np.cos(self.tip.vee.turn_rad) / np.cos(self.tip.taper_rad))


def tip_height_mm(stem: Stem) -> float:
    """Of a tip that is not as the stem behind it; else 0."""
    match stem:
        case TaperedStem():
            return stem.taper.height_mm
        case VStem():
            return stem.tip.height_mm
        case _:
            return 0.0


def tip_properties(stem: Stem) -> dict[str, float]:
    """Figures of such a tip, mm and degrees."""
    match stem:
        case TaperedStem():
            return {"taper_degrees": math.degrees(stem.taper.angle_rad), "tip_height_mm": stem.taper.height_mm}
        case VStem():
            tip = stem.tip
            figures = {"v_angle_degrees": tip.vee.degrees, "v_depth_mm": tip.vee.depth_mm, "tip_height_mm": tip.height_mm}
            return figures | ({"taper_degrees": math.degrees(tip.taper_rad)} if tip.taper_rad else {})
        case _:
            return {}
