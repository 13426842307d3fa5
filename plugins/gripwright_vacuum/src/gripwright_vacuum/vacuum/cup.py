"""The measures of a flat suction cup of a given lip, and of the holder that carries it. Lengths in mm, frame F: lip at z = 0."""

from dataclasses import dataclass

STANDARD_MM = (8.0, 13.0, 20.0, 32.0, 50.0, 80.0)
"""Lip diameters that makers of suction cups have in common."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Thread:
    """The stud of a cup, which is screwed into its holder."""

    name: str
    radius_mm: float
    length_mm: float
    bore_radius_mm: float  # for the air


_SMALL = Thread(name="M5", radius_mm=2.5, length_mm=5.0, bore_radius_mm=1.25)
_MIDDLE = Thread(name="G1/8", radius_mm=4.864, length_mm=7.0, bore_radius_mm=2.5)
_LARGE = Thread(name="G1/4", radius_mm=6.579, length_mm=9.0, bore_radius_mm=4.0)
_SMALL_TO_MM, _MIDDLE_TO_MM = 16.0, 40.0
_LIP_HEIGHT, _NECK_RADIUS, _LIP_THICKNESS = 0.22, 0.28, 0.04  # as shares of the diameter
_COLLAR_MM = 6.0
_WALL_MM = 3.0  # of the holder around the stud
_BEHIND_STUD_MM = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CupMeasures:
    """A cup from lip to collar, and the stem behind it."""

    diameter_mm: float

    @property
    def thread(self) -> Thread:
        """Small, middle or large."""
        return _SMALL if self.diameter_mm <= _SMALL_TO_MM else _MIDDLE if self.diameter_mm <= _MIDDLE_TO_MM else _LARGE

    @property
    def lip_height_mm(self) -> float:
        """From the lip's edge back to the collar."""
        return max(3.0, _LIP_HEIGHT * self.diameter_mm)

    @property
    def lip_thickness_mm(self) -> float:
        """Of the rubber."""
        return max(1.0, _LIP_THICKNESS * self.diameter_mm)

    @property
    def neck_radius_mm(self) -> float:
        """Of the collar."""
        return min(max(self.thread.radius_mm + 1.0, _NECK_RADIUS * self.diameter_mm), self.diameter_mm / 2.0 - 0.2)

    @property
    def height_mm(self) -> float:
        """Lip and collar."""
        return self.lip_height_mm + _COLLAR_MM

    @property
    def stem_radius_mm(self) -> float:
        """Of the holder."""
        return self.thread.radius_mm + _WALL_MM

    @property
    def length_min_mm(self) -> float:
        """From the lip back to where a holder may end: the cup, its stud, and what closes the thread."""
        return self.height_mm + self.thread.length_mm + _BEHIND_STUD_MM
