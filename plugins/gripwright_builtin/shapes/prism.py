"""Regular prisms, hexagonal ones above all: the primitive and its fitter."""

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

_STRAIGHT_RAD = float(np.radians(0.5))
_BOX = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prism:
    """A right prism over a regular polygon, or a socket of that form."""

    sides: int  # 3, 5, 6, …
    center_C: FloatArray  # (3,) midpoint of the axis
    axis_C: FloatArray  # (3,) unit
    side_C: FloatArray  # (3,) unit, across the axis, towards the middle of the first side
    across_flats_mm: float  # diameter of the inscribed circle; of an even number of sides the distance of opposite ones
    height_mm: float
    internal: bool  # True: a socket
    filled: FloatArray  # (sides,) share of each side that is covered by surface, counter-clockwise about the axis, 0..1
    ends_filled: FloatArray  # (2,) the same of the end faces, first the one at −axis
    filled_min: float  # share from which a side counts as filled
    rms_mm: float
    kind: str = field(default="prism", init=False)

    @property
    def volume_mm3(self) -> float:
        """n r² tan(π/n) h with the inscribed radius r."""
        return float(self.sides * np.tan(np.pi / self.sides) * (self.across_flats_mm / 2.0) ** 2 * self.height_mm)

    @property
    def surface_filled(self) -> bool:
        """Whether the sides are filled on the mean."""
        return bool(self.filled.mean() >= self.filled_min)

    @property
    def sides_C(self) -> FloatArray:
        """Unit vectors from the axis to the middles of the sides, (sides, 3)."""
        return side_planes(self.sides, self.center_C, self.axis_C, self.side_C, self.across_flats_mm / 2.0, 0.0)[0]

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`; a socket has no end faces."""
        around = side_planes(self.sides, self.center_C, self.axis_C, self.side_C, self.across_flats_mm / 2.0, 0.0)
        solid = (self.center_C, self.axis_C, self.height_mm, self.internal)
        return on_sides_and_ends(points_mm, normals, around, solid, tolerance_mm, angle_rad)

    def drawn(self) -> Mesh:
        """See `DrawnPrimitive`."""
        radius = self.across_flats_mm / 2.0
        return regular_solid(self.sides, self.center_C, self.axis_C, self.side_C, radius, self.height_mm, 1.0)

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm."""
        return {
            "sides": self.sides,
            "across_flats": self.across_flats_mm,
            "height": self.height_mm,
            "axis": self.axis_C.tolist(),
            "side": self.side_C.tolist(),
            "center": self.center_C.tolist(),
            "internal": self.internal,
            "filled": self.filled.tolist(),
            "ends_filled": self.ends_filled.tolist(),
            "rms": self.rms_mm,
        }


class PrismParams(Params):
    """What counts as a regular prism."""

    sides_max: int = Field(8, ge=3, le=8, description="Most sides; nine and more are round.")
    support_min: float = Field(0.1, gt=0, le=1, description="Least share of the segment's area on the sides.")
    filled_min: float = Field(0.35, gt=0, le=1, description="Share of a side's area from which it counts as filled.")
    rms_max: float = Field(
        0.01, gt=0, le=1, description="Largest root mean square distance from the sides, share of the inscribed radius."
    )


class PrismFitter:
    """Fits the regular prism whose sides a segment has."""

    key: ClassVar[str] = "prism"
    params_model: ClassVar[type[PrismParams]] = PrismParams

    def __init__(self, params: PrismParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Prism | Rejection:
        """The prism, or `no-prism` with the measured value and the limit."""
        refused: Rejection | None = None
        for found in regular_sides(component.mesh, segment.faces, (0.0, _STRAIGHT_RAD), self._params.sides_max):
            no = self._refused(found)
            if no is None:
                return self._prism(found)
            refused = refused or no
        return refused or Rejection("no-prism", f"no 3 to {self._params.sides_max} flat sides stand evenly about an axis")

    def _refused(self, found: RegularSides) -> Rejection | None:
        limit = self._params.rms_max * found.inradius_mm
        if found.rms_mm > limit:
            return Rejection(
                "no-prism", f"the sides deviate by {found.rms_mm:.3g} mm from a regular prism, at most {limit:.3g} mm"
            )
        if found.sides == _BOX:
            return Rejection("no-prism", "four even sides are those of a box")
        if found.share < self._params.support_min:
            share, least = 100 * found.share, 100 * self._params.support_min
            return Rejection("no-prism", f"{share:.1f} % of the surface lies on {found.sides} even sides, at least {least:.1f} %")
        return None

    def _prism(self, found: RegularSides) -> Prism:
        return Prism(
            sides=found.sides,
            center_C=found.center_C,
            axis_C=found.axis_C,
            side_C=found.side_C,
            across_flats_mm=found.inradius_mm + found.inradius_top_mm,
            height_mm=found.height_mm,
            internal=found.internal,
            filled=found.filled,
            ends_filled=found.ends_filled,
            filled_min=self._params.filled_min,
            rms_mm=found.rms_mm,
        )
