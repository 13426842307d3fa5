"""Regular pyramids and their frusta: the primitive and its fitter."""

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import BoolArray, FloatArray, Mesh, Segment
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.shapes.polygon import on_sides_and_ends, regular_solid, side_planes
from gripwright_builtin.shapes.regular_sides import RegularSides, regular_sides


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pyramid:
    """A right pyramid over a regular polygon, or a frustum of one; `axis_C` points from the foot to the narrow end."""

    sides: int
    center_C: FloatArray  # (3,) midpoint of the axis
    axis_C: FloatArray  # (3,) unit
    side_C: FloatArray  # (3,) unit, across the axis, towards the middle of the first side
    across_flats_mm: float  # of the foot: diameter of the inscribed circle
    across_flats_top_mm: float  # of the narrow end, 0: it has its apex
    height_mm: float
    internal: bool  # True: a hollow
    filled: FloatArray  # (sides,) share of each side that is covered by surface, counter-clockwise about the axis, 0..1
    ends_filled: FloatArray  # (2,) the same of the foot and the narrow end
    filled_min: float  # share from which a side counts as filled
    rms_mm: float
    kind: str = field(default="pyramid", init=False)

    @property
    def half_angle_rad(self) -> float:
        """Between the axis and the sides, 0..π/2."""
        return float(np.arctan2((self.across_flats_mm - self.across_flats_top_mm) / 2.0, self.height_mm))

    @property
    def truncated(self) -> bool:
        """Whether it is a frustum."""
        return self.across_flats_top_mm > 0.0

    @property
    def volume_mm3(self) -> float:
        """n tan(π/n) h (R² + R r + r²) / 3 with the inscribed radii of foot and narrow end."""
        wide, narrow = self.across_flats_mm / 2.0, self.across_flats_top_mm / 2.0
        return float(self.sides * np.tan(np.pi / self.sides) * self.height_mm * (wide**2 + wide * narrow + narrow**2) / 3.0)

    @property
    def surface_filled(self) -> bool:
        """Whether the sides are filled on the mean."""
        return bool(self.filled.mean() >= self.filled_min)

    @property
    def _planes(self) -> tuple[FloatArray, FloatArray]:
        mean = (self.across_flats_mm + self.across_flats_top_mm) / 4.0
        return side_planes(self.sides, self.center_C, self.axis_C, self.side_C, mean, self.half_angle_rad)

    @property
    def sides_C(self) -> FloatArray:
        """Unit vectors across the axis to the middles of the sides, (sides, 3)."""
        return side_planes(self.sides, self.center_C, self.axis_C, self.side_C, self.across_flats_mm / 2.0, 0.0)[0]

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`; a hollow has no end faces."""
        solid = (self.center_C, self.axis_C, self.height_mm, self.internal)
        return on_sides_and_ends(points_mm, normals, self._planes, solid, tolerance_mm, angle_rad)

    def drawn(self) -> Mesh:
        """See `DrawnPrimitive`."""
        radius, top = self.across_flats_mm / 2.0, self.across_flats_top_mm / self.across_flats_mm
        return regular_solid(self.sides, self.center_C, self.axis_C, self.side_C, radius, self.height_mm, top)

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm and degrees."""
        return {
            "sides": self.sides,
            "across_flats": self.across_flats_mm,
            "across_flats_top": self.across_flats_top_mm,
            "height": self.height_mm,
            "half_angle": float(np.degrees(self.half_angle_rad)),
            "truncated": self.truncated,
            "axis": self.axis_C.tolist(),
            "side": self.side_C.tolist(),
            "center": self.center_C.tolist(),
            "internal": self.internal,
            "filled": self.filled.tolist(),
            "ends_filled": self.ends_filled.tolist(),
            "rms": self.rms_mm,
        }


class PyramidParams(Params):
    """What counts as a regular pyramid."""

    sides_max: int = Field(8, ge=3, le=8, description="Most sides; nine and more are round.")
    half_angle_min: float = Field(0.5, gt=0, lt=45, description="Least half angle, degrees; a more slender one is a prism.")
    half_angle_max: float = Field(70.0, gt=45, le=85, description="Largest half angle, degrees; a wider one is nearly flat.")
    support_min: float = Field(0.2, gt=0, le=1, description="Least share of the segment's area on the sides.")
    side_min: float = Field(0.6, gt=0, le=1, description="Least share of each side that is covered by surface.")
    filled_min: float = Field(0.6, gt=0, le=1, description="Share of a side's area from which it counts as filled.")
    rms_max: float = Field(
        0.01, gt=0, le=1, description="Largest root mean square distance from the sides, share of the inscribed radius."
    )


class PyramidFitter:
    """Fits the regular pyramid, or the frustum of one, whose sides a segment has."""

    key: ClassVar[str] = "pyramid"
    params_model: ClassVar[type[PyramidParams]] = PyramidParams

    def __init__(self, params: PyramidParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Pyramid | Rejection:
        """The pyramid, or `no-pyramid` with the measured value and the limit."""
        params, refused = self._params, None
        angles = (float(np.radians(params.half_angle_min)), float(np.radians(params.half_angle_max)))
        for found in regular_sides(component.mesh, segment.faces, angles, params.sides_max):
            no = self._refused(found)
            if no is None:
                return self._pyramid(found)
            refused = refused or no
        return refused or Rejection(
            "no-pyramid",
            f"no 3 to {params.sides_max} flat sides stand evenly about an axis at {params.half_angle_min:.1f} to "
            f"{params.half_angle_max:.1f}°",
        )

    def _refused(self, found: RegularSides) -> Rejection | None:
        limit = self._params.rms_max * found.inradius_mm
        if found.rms_mm > limit:
            return Rejection(
                "no-pyramid", f"the sides deviate by {found.rms_mm:.3g} mm from a regular pyramid, at most {limit:.3g} mm"
            )
        if found.filled.min() < self._params.side_min:
            share, least = 100 * found.filled.min(), 100 * self._params.side_min
            return Rejection("no-pyramid", f"one of {found.sides} sides is covered to {share:.1f} %, at least {least:.1f} %")
        if found.share < self._params.support_min:
            share, least = 100 * found.share, 100 * self._params.support_min
            return Rejection("no-pyramid", f"{share:.1f} % of the surface lies on {found.sides} sides, at least {least:.1f} %")
        return None

    def _pyramid(self, found: RegularSides) -> Pyramid:
        return Pyramid(
            sides=found.sides,
            center_C=found.center_C,
            axis_C=found.axis_C,
            side_C=found.side_C,
            across_flats_mm=2.0 * found.inradius_mm,
            across_flats_top_mm=2.0 * found.inradius_top_mm,
            height_mm=found.height_mm,
            internal=found.internal,
            filled=found.filled,
            ends_filled=found.ends_filled,
            filled_min=self._params.filled_min,
            rms_mm=found.rms_mm,
        )
