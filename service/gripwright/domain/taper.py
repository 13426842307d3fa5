"""The taper of a fingertip. Lengths in mm, finger frame of an external grip."""

import math
from dataclasses import dataclass

import numpy as np

from gripwright.domain.shape import FloatArray

TIP_HEIGHT_MM = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Taper:
    """A plane gripping surface from the tip's end back to z = −height, inclined to the gripper's axis; the stem begins behind it.

    Of a positive angle the gripping surfaces come nearer to each other towards the tips' ends, of a negative one farther apart.
    The innermost edge lies in the plane x = 0.
    """

    angle_rad: float  # not 0
    height_mm: float = TIP_HEIGHT_MM

    @property
    def depth_mm(self) -> float:
        """How far the gripping surface recedes from the plane x = 0."""
        return self.height_mm * math.tan(abs(self.angle_rad))

    @property
    def tip_mm(self) -> float:
        """x of the gripping surface at the tip's end, z = 0."""
        return self.depth_mm if self.angle_rad < 0.0 else 0.0

    @property
    def stem_mm(self) -> float:
        """x of the stem's inner side, and of the gripping surface where it begins."""
        return 0.0 if self.angle_rad < 0.0 else self.depth_mm

    @property
    def leaving_mm(self) -> float:
        """How much farther than others such fingers open to let go: their tips reach in front of what they hold."""
        return 2.0 * max(self.stem_mm - self.tip_mm, 0.0)

    @property
    def slant_mm(self) -> float:
        """Height of the gripping surface along itself."""
        return self.height_mm / math.cos(self.angle_rad)

    @property
    def X_FP(self) -> FloatArray:
        """Frame P stands at the tip's end: the gripping surface lies in P's plane x = 0, and P's z leads along it to the end."""
        X, cos, sin = np.eye(4), math.cos(self.angle_rad), math.sin(self.angle_rad)
        X[[0, 0, 2, 2], [0, 2, 0, 2]] = cos, -sin, sin, cos
        X[0, 3] = self.tip_mm
        return X


def taper_words(taper_rad: float) -> str:
    """A taper as people say it: "tapered 12.0° towards the palm"; it is where the gripping surfaces come together."""
    return f"tapered {math.degrees(abs(taper_rad)):.1f}° towards the {'tips' if taper_rad > 0.0 else 'palm'}"
