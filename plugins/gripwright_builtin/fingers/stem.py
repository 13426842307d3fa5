"""The stem of a finger in plan (finger frame, seen along z): a rectangle, hollow or not, or a slice of a cylinder for bores."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from gripwright.domain.groove import Groove
from gripwright.domain.shape import FloatArray
from gripwright_builtin.fingers.outline import convex_hull, rectangle
from gripwright_builtin.fingers.stiffness import Section, polygon_section, rectangle_section

if TYPE_CHECKING:  # the CAD kernel takes most of a second, and most designs that are repeated make no finger
    from gripwright.geometry import brep

_ARC_POINTS = 61
_STEP_RAD = 0.25  # of the mesh of holes
_GROOVE_DEVIATION_MM = 0.002  # of the mesh of a groove
_NOSE_STEP_RAD = float(np.radians(3.0))  # of the mesh of a rounded nose: its flats stay parallel to what it touches


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PadStrip:
    """The pad in its place, and thickness, width and length of the flat strip that it is cut as."""

    solid: "brep.Shape"
    size_mm: tuple[float, float, float]


class Stem(Protocol):
    """A stem of the same section from the base to the tip, which may have a taper or a V; its gripping surface touches x = 0."""

    @property
    def outline_mm(self) -> FloatArray:
        """Corners of the section, (k, 2), convex, counter-clockwise."""
        ...

    @property
    def section(self) -> Section:
        """How it bends along x."""
        ...

    def solid(self, length_mm: float) -> "brep.Shape":
        """The stem with its pad, rooted 1 mm deep in the base."""
        ...

    def pad(self, length_mm: float) -> PadStrip | None:
        """The pad alone: the layer next to the gripping surface, from the tip to the base. None: there is none."""
        ...

    @property
    def wall_mm(self) -> float:
        """Thickness of the stem without its pad."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class FlatStem:
    """A rectangle; its outer edges are chamfered, those of the gripping surface are not. The pad covers one side of it."""

    thickness_mm: float  # pad included
    width_mm: float
    chamfer_mm: float
    inside: bool  # an internal grip: it lies at x ≤ 0
    pad_mm: float

    @property
    def outline_mm(self) -> FloatArray:
        """The whole rectangle."""
        x = (-self.thickness_mm, 0.0) if self.inside else (0.0, self.thickness_mm)
        return rectangle(*x, self.width_mm)

    @property
    def section(self) -> Section:
        """Of what carries the pad; the chamfers are left out of account."""
        return rectangle_section(self.wall_mm, self.width_mm)

    @property
    def wall_mm(self) -> float:
        """All but the pad."""
        return self.thickness_mm - self.pad_mm

    def solid(self, length_mm: float) -> "brep.Shape":
        """Chamfered along the outer edges and at the tip."""
        from gripwright.geometry import brep

        y, c = self.width_mm / 2.0, min(self.chamfer_mm, self.thickness_mm / 3.0, self.width_mm / 3.0, length_mm / 3.0)
        outer, inner = (-self.thickness_mm, 0.0) if self.inside else (self.thickness_mm, 0.0)
        toward = np.sign(inner - outer) * c
        corners = [[inner, -y], [outer + toward, -y], [outer, c - y], [outer, y - c], [outer + toward, y], [inner, y]]
        stem = brep.prism_z(convex_hull(np.array(corners)), -length_mm - 1.0, 0.0)
        if c == 0.0:
            return stem
        return brep.chamfer(stem, c, np.array([outer, -y, 0.0]), np.array([outer, y, 0.0]))

    def pad(self, length_mm: float) -> PadStrip:
        """A strip as wide as the stem."""
        from gripwright.geometry import brep

        y, (low, high) = self.width_mm / 2.0, sorted((0.0, -self.pad_mm if self.inside else self.pad_mm))
        solid = brep.box((low, -y, -length_mm), (high, y, 0.0))
        return PadStrip(solid=solid, size_mm=(self.pad_mm, self.width_mm, length_mm))


@dataclass(frozen=True, slots=True, kw_only=True)
class CutStem(ABC):
    """A stem whose gripping surface is cut from a flat one; it bends as the rectangle behind what is cut deepest."""

    flat: FlatStem  # as thick as the stem and the depth of the cut together; for an external grip

    @property
    def outline_mm(self) -> FloatArray:
        """The rectangle around it."""
        return self.flat.outline_mm

    @property
    def section(self) -> Section:
        """Of the rectangle behind the pad where the cut is deepest; what stands beside it is left out of account."""
        return rectangle_section(self.wall_mm, self.flat.width_mm)

    @property
    @abstractmethod
    def wall_mm(self) -> float:
        """Behind the pad where the cut is deepest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GroovedStem(CutStem):
    """A flat stem whose gripping surface is hollow; the pad lines the groove."""

    groove: Groove  # at whose corners the stem is as thick as the flat one

    @property
    def wall_mm(self) -> float:
        """Where the groove is deepest."""
        return self.flat.wall_mm - self.groove.depth_mm

    def solid(self, length_mm: float) -> "brep.Shape":
        """The flat stem without the cylinder of the groove; its root in the base is whole."""
        from gripwright.geometry import brep

        return brep.cut(self.flat.solid(length_mm), [self._cylinder(self.groove.radius_mm, length_mm)])

    def pad(self, length_mm: float) -> PadStrip:
        """A strip bent into the groove, level with the stem's sides and corners."""
        from gripwright.geometry import brep

        y, back = self.flat.width_mm / 2.0, self.flat.thickness_mm
        within = brep.common(
            brep.box((0.0, -y, -length_mm), (back, y, 0.0)), self._cylinder(self.groove.radius_mm + self.flat.pad_mm, length_mm)
        )
        middle = self.groove.radius_mm + self.flat.pad_mm / 2.0
        across = float(2.0 * middle * np.arcsin(self.flat.width_mm / 2.0 / middle))  # as its middle layer
        return PadStrip(
            solid=brep.cut(within, [self._cylinder(self.groove.radius_mm, length_mm)]),
            size_mm=(self.flat.pad_mm, across, length_mm),
        )

    def _cylinder(self, radius_mm: float, length_mm: float) -> "brep.Shape":
        from gripwright.geometry import brep

        return brep.cylinder_z(self.groove.axis_x_mm, 0.0, radius_mm, -length_mm, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SliceStem:
    """A slice of a cylinder without its core, at x ≤ 0: the round side is the nose that touches a bore. It carries no pad."""

    slices: int  # as many as fingers
    nose_radius_mm: float
    thickness_mm: float  # from the nose towards the axis

    @property
    def outline_mm(self) -> FloatArray:
        """The arc by points on it."""
        half = np.pi / self.slices
        angles = np.linspace(-half, half, _ARC_POINTS)
        arc = self.nose_radius_mm * np.stack([np.cos(angles) - 1.0, np.sin(angles)], axis=1)
        return convex_hull(np.concatenate([arc, self._flanks(-self.thickness_mm)]))

    @property
    def section(self) -> Section:
        """Of the outline."""
        return polygon_section(self.outline_mm)

    @property
    def wall_mm(self) -> float:
        """All of it."""
        return self.thickness_mm

    def solid(self, length_mm: float) -> "brep.Shape":
        """The nose is an exact cylinder, whole up to the tip."""
        from gripwright.geometry import brep

        back, front = self._flanks(-self.thickness_mm), self._flanks(1.0)
        wedge = brep.prism_z(np.concatenate([back, front[::-1]]), -length_mm - 1.0, 0.0)
        return brep.common(brep.cylinder_z(-self.nose_radius_mm, 0.0, self.nose_radius_mm, -length_mm - 1.0, 0.0), wedge)

    def pad(self, length_mm: float) -> None:
        """There is none: a layer round the nose would leave too little of a stem that a bore keeps thin."""

    def _flanks(self, x_mm: float) -> FloatArray:
        """Where the planes between neighbouring slices pass x, (2, 2)."""
        y = np.tan(np.pi / self.slices) * (self.nose_radius_mm + x_mm)
        return np.array([[x_mm, -y], [x_mm, y]])


def step_rad(stem: Stem) -> float:
    """By how much the flats of a finger's mesh turn at most."""
    match stem:
        case SliceStem():
            return _NOSE_STEP_RAD
        case GroovedStem():
            return float(2.0 * np.arccos(1.0 - _GROOVE_DEVIATION_MM / stem.groove.radius_mm))
        case _:
            return _STEP_RAD


def x_range(stem: Stem) -> tuple[float, float]:
    """Least and greatest x of a stem."""
    return float(stem.outline_mm[:, 0].min()), float(stem.outline_mm[:, 0].max())
