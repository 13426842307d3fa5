"""The flange that both holders have behind z = −L: it is bolted to the actuator. Lengths in mm, frame F."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from gripwright.domain.errors import Rejection
from gripwright.domain.gripper import BoughtPart, FingerSpec

if TYPE_CHECKING:
    from gripwright.geometry import brep

_WALL_MM = 2.0
_SCREW_MM, _HOLE_MM, _HEAD_MM = 4.0, 4.5, 7.5  # M4, its through hole (ISO 273 medium) and its head (ISO 4762)
_SCREW = "ISO 4762 M4x12-8.8"
_REST_MM = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Flange:
    """A disc with two holes on either side of the stem."""

    radius_mm: float
    bolt_radius_mm: float  # of the circle on which the holes lie
    thickness_mm: float = 8.0

    def solid(self, front_mm: float) -> "brep.Shape":
        """The flange whose front lies at that z."""
        from gripwright.geometry import brep

        back = front_mm - self.thickness_mm
        holes = [brep.cylinder_z(x, 0.0, _HOLE_MM / 2.0, back - 1.0, front_mm + 1.0) for x in self._places()]
        return brep.cut(brep.cylinder_z(0.0, 0.0, self.radius_mm, back, front_mm), holes)

    def properties(self) -> dict[str, float]:
        """Figures for the drawing and the bill."""
        return {
            "bolt_thread_mm": _SCREW_MM,
            "bolt_hole_mm": _HOLE_MM,
            "bolt_pitch_mm": 2.0 * self.bolt_radius_mm,
            "base_thickness_mm": self.thickness_mm,
            "base_diameter_mm": 2.0 * self.radius_mm,
        }

    def screws(self, actuator: str) -> BoughtPart:
        """What fastens it."""
        return BoughtPart(
            item="screw",
            designation=_SCREW,
            description=f"hexagon socket head cap screw, flange to {actuator}",
            material="steel 8.8",
            quantity=len(self._places()),
        )

    def _places(self) -> tuple[float, float]:
        return -self.bolt_radius_mm, self.bolt_radius_mm


def flange_around(stem_radius_mm: float, spec: FingerSpec) -> Flange | Rejection:
    """The least flange around a stem, where the palm envelope has room for it."""
    bolts = stem_radius_mm + _HEAD_MM / 2.0 + 0.5
    radius = bolts + _HEAD_MM / 2.0 + _WALL_MM
    if radius > spec.envelope_mm + _REST_MM:
        return Rejection(
            "base-outside-envelope",
            f"the flange needs {radius:.2f} mm about the gripper's axis, {spec.actuator.name} has {spec.envelope_mm:.2f} mm",
        )
    return Flange(radius_mm=radius, bolt_radius_mm=bolts)
