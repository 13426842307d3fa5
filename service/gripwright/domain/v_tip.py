"""The V of a fingertip that holds round things along their axis. Lengths in mm, finger frame of an external grip."""

import math
from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray
from gripwright.domain.taper import TIP_HEIGHT_MM, taper_words

SIDES = (-1.0, 1.0)
"""Of y: the two flanks of a V."""

_ANGLES = (60.0, 180.0)  # degrees
_SAME_RAD, _SAME_MM = 1e-5, 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Vee:
    """Two plane flanks along the finger: they meet in its middle, where the V is deepest, and end at the tip's sides."""

    angle_rad: float  # between the flanks, of every section across the finger
    depth_mm: float

    def __post_init__(self) -> None:
        low, high = _ANGLES
        if not (low <= math.degrees(self.angle_rad) + 1e-9 and math.degrees(self.angle_rad) < high and self.depth_mm > 0.0):
            raise ValueError(
                f"a V opens by {low:.0f}° to less than {high:.0f}° and has a depth; "
                f"asked for is {math.degrees(self.angle_rad):.1f}°, {self.depth_mm:g} mm"
            )

    @property
    def turn_rad(self) -> float:
        """Between a flank's normal and the finger's x."""
        return (math.pi - self.angle_rad) / 2.0

    @property
    def width_mm(self) -> float:
        """Of the tip, from edge to edge."""
        return 2.0 * self.depth_mm * math.tan(self.angle_rad / 2.0)

    @property
    def degrees(self) -> float:
        """The angle between the flanks, as people write it."""
        return round(math.degrees(self.angle_rad), 6)

    def opening_mm(self, radius_mm: float) -> float:
        """How far apart the edges of two such V stand that hold a circle of that radius."""
        return 2.0 * (radius_mm / math.cos(self.turn_rad) - self.depth_mm)

    def aside_mm(self, radius_mm: float) -> float:
        """How far from the middle of the V it touches that circle."""
        return radius_mm * math.sin(self.turn_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class VTip:
    """A V from the tip's end back to z = −height, tapered like what it holds; the stem, as wide, begins behind it.

    The sections across it are all alike. Their edges, the innermost of the tip, reach the plane x = 0 where they are nearest to
    the gripper's axis. A cone of the half angle `taper_rad` touches each flank along a line; see `Taper` for its sign.
    """

    vee: Vee
    taper_rad: float = 0.0  # 0: for cylinders
    height_mm: float = TIP_HEIGHT_MM

    @property
    def rise_mm(self) -> float:
        """By how much the edges recede from the plane x = 0."""
        return self.height_mm * math.tan(abs(self.taper_rad)) / math.cos(self.vee.turn_rad)

    @property
    def depth_mm(self) -> float:
        """How much farther than a straight finger of the same strength it reaches."""
        return self.vee.depth_mm + self.rise_mm

    @property
    def tip_mm(self) -> float:
        """x of the edges at the tip's end, z = 0."""
        return self.rise_mm if self.taper_rad < 0.0 else 0.0

    @property
    def stem_mm(self) -> float:
        """x of the edges where the stem begins."""
        return self.rise_mm if self.taper_rad > 0.0 else 0.0

    @property
    def back_mm(self) -> float:
        """x of the stem's inner side, and of the V's bottom where it begins."""
        return self.stem_mm + self.vee.depth_mm

    @property
    def slope(self) -> float:
        """By how much edges and bottom recede, a mm of the way back from the tip's end."""
        return (self.stem_mm - self.tip_mm) / self.height_mm

    @property
    def incline_rad(self) -> float:
        """Between edges or bottom and the gripper's axis: more than the taper, which is that of what is held; not negative."""
        return math.atan(abs(self.slope))

    @property
    def leaving_mm(self) -> float:
        """How much farther than others such fingers open to let go, as tapered ones do."""
        return 2.0 * max(self.stem_mm - self.tip_mm, 0.0)

    @property
    def slant_mm(self) -> float:
        """Height of a flank along the line in which a cone touches it."""
        return self.height_mm / math.cos(self.taper_rad)

    @property
    def flank_mm2(self) -> float:
        """Area of one flank."""
        return self.slant_mm * self.vee.width_mm / 2.0 / math.cos(self.vee.turn_rad)

    def section_mm(self, z_mm: float) -> FloatArray:
        """Edge, bottom, edge at that height, (3, 2) of x and y, ascending in y."""
        edge, half = self.tip_mm - z_mm * self.slope, self.vee.width_mm / 2.0
        return np.array([[edge, -half], [edge + self.vee.depth_mm, 0.0], [edge, half]])

    def X_FP(self, side: float) -> FloatArray:
        """Frame P of the flank on that side of y: its plane is x = 0, and z leads along the line of touch to the tip's end."""
        X, (cos, sin) = np.eye(4), (math.cos(self.taper_rad), math.sin(self.taper_rad))
        across, aside = math.cos(self.vee.turn_rad), side * math.sin(self.vee.turn_rad)
        X[:3, :3] = [[across * cos, -aside, -across * sin], [aside * cos, across, -aside * sin], [sin, 0.0, cos]]
        X[:3, 3] = self.tip_mm + self.vee.depth_mm / 2.0, side * self.vee.width_mm / 4.0, 0.0
        return X


def same_vee(one: Vee | None, other: Vee | None) -> bool:
    """Whether two tips have the same V, or none: figures of documents are rounded."""
    if one is None or other is None:
        return one is other
    return abs(one.angle_rad - other.angle_rad) < _SAME_RAD and abs(one.depth_mm - other.depth_mm) < _SAME_MM


def tip_words(taper_rad: float, vee: Vee | None) -> str:
    """Tips as people say it, nothing of straight ones: "V of 120.0°, 5 mm deep, tapered 12.0° towards the palm"."""
    words = [] if vee is None else [f"V of {vee.degrees:.1f}°, {vee.depth_mm:g} mm deep"]
    return ", ".join([*words, *([taper_words(taper_rad)] if taper_rad else [])])
