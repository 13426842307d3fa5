"""Cylinders that a gripper can hold (paper, section 4.2)."""

from typing import ClassVar

from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Cylinder, Segment
from gripwright.plugin_api import Params, RunContext
from gripwright_builtin.fitters.search import FoundCylinder, find_cylinders


class CylinderParams(Params):
    """What counts as a cylinder that can be held."""

    support_min: float = Field(
        0.05, gt=0, le=1, description="Least share of the segment's area, faces across the axis left out, on the cylinder."
    )
    filled_min: float = Field(0.35, ge=0, le=1, description="Share of the lateral area from which the surface counts as filled.")
    three_finger_min: float = Field(
        0.25, ge=0, le=1, description="Share of the height that each of three fingers, 120 degrees apart, must find."
    )
    rms_max: float = Field(0.03, gt=0, description="Largest root mean square distance, as a share of the radius.")


class CylinderFitter:
    """Fits the cylinder that a gripper would hold: an outer surface before a bore, a filled one before an empty one."""

    key: ClassVar[str] = "cylinder"
    params_model: ClassVar[type[CylinderParams]] = CylinderParams

    def __init__(self, params: CylinderParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Cylinder | Rejection:
        """The cylinder with the standard errors of its radius and axis, or why there is none."""
        found = find_cylinders(component.mesh, segment.faces, ctx.rng)
        refused = [self._refused(one) for one in found]
        usable = [one for one, no in zip(found, refused, strict=True) if no is None]
        if usable:
            best = min(usable, key=self._rank)
            bores = (one for one in usable if one.sign < 0 < best.sign and self._filled(one))
            bore = max(bores, key=lambda one: one.score, default=None)
            return self._cylinder(best, None if bore is None else self._cylinder(bore))
        return next(
            (no for no in refused if no is not None), Rejection("no-cylinder", "no part of the surface follows a cylinder")
        )

    def _refused(self, found: FoundCylinder) -> Rejection | None:
        """Why a cylinder does not speak for the segment."""
        share, radius = found.area_mm2 / max(found.around_mm2, 1e-300), found.fit.radius_mm
        if share < self._params.support_min:
            return Rejection(
                "no-cylinder",
                f"{100 * share:.1f} % of the surface around the axis lies on the best cylinder (radius {radius:.2f} mm), "
                f"at least {100 * self._params.support_min:.1f} % needed",
            )
        if found.fit.rms_mm > self._params.rms_max * radius:
            return Rejection(
                "not-round",
                f"the surface deviates by {found.fit.rms_mm:.3g} mm from a cylinder of radius {radius:.2f} mm, "
                f"at most {self._params.rms_max * radius:.3g} mm",
            )
        return None

    def _cylinder(self, found: FoundCylinder, bore: Cylinder | None = None) -> Cylinder:
        fit = found.fit
        return Cylinder(
            center_C=fit.point_mm + fit.axis * (found.low_mm + found.high_mm) / 2.0,
            axis_C=fit.axis,
            radius_mm=fit.radius_mm,
            height_mm=found.high_mm - found.low_mm,
            internal=found.sign < 0,
            arc_rad=found.arc_rad,
            rms_mm=fit.rms_mm,
            surface_filled=self._filled(found),
            radius_sigma_mm=fit.radius_sigma_mm,
            axis_sigma_rad=fit.axis_sigma_rad,
            bore=bore,
        )

    def _filled(self, found: FoundCylinder) -> bool:
        return found.filled >= self._params.filled_min and found.three_finger >= self._params.three_finger_min

    def _rank(self, found: FoundCylinder) -> tuple[bool, float]:
        """A filled outer surface first, then the score: a bore is the answer only where it is all there is."""
        return not (found.sign > 0 and self._filled(found)), -found.score
