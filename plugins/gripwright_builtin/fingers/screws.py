"""Holes for cylinder head screws (ISO 4762) that fasten a finger to its jaw."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ScrewHole:
    """Clearance hole (ISO 273, medium) and a bore that sinks the head."""

    through_mm: float
    head_bore_mm: float
    head_depth_mm: float


BY_THREAD: dict[float, ScrewHole] = {
    2.5: ScrewHole(through_mm=2.9, head_bore_mm=5.0, head_depth_mm=3.0),
    3.0: ScrewHole(through_mm=3.4, head_bore_mm=6.0, head_depth_mm=3.5),
    4.0: ScrewHole(through_mm=4.5, head_bore_mm=7.5, head_depth_mm=4.5),
    5.0: ScrewHole(through_mm=5.5, head_bore_mm=9.0, head_depth_mm=5.5),
    6.0: ScrewHole(through_mm=6.6, head_bore_mm=10.5, head_depth_mm=6.5),
}
