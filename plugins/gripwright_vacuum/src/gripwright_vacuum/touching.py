"""Where a round face touches: its seat, and whether all of it lies on flat surface. Gripper frame G, lengths in mm."""

from dataclasses import dataclass, replace

import numpy as np
import shapely

from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import Grasp
from gripwright.domain.shape import FloatArray
from gripwright.geometry.held_surface import PARALLEL_RAD, SEAT_MM, TOUCH_GAP_MM, Surface

_SEARCH_MM = 0.5  # how far the surface may lie from the planned face
_CORNERS = 64  # of the polygon that stands for the face's rim
_JOIN_MM = 1e-4  # by so much triangles are widened, so that none of two neighbours' common edge is left out
_BESIDE_MM2 = 1e-2  # of a face may lie beside the surface: what rounding makes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Touch:
    """What of a face touches: the area that lies beside the flat surface, and the least gap."""

    beside_mm2: float
    gap_mm: float


def seated(grasp: Grasp, surface: Surface) -> Grasp | Rejection:
    """The grasp moved along its z until the foremost point of the surface before the face just touches."""
    levels = _before(grasp, surface, _SEARCH_MM)[..., 2]
    if not levels.size:
        return Rejection("no-contact", f"there is no surface within {_SEARCH_MM} mm of the face")
    X_CG = grasp.X_CG.copy()
    X_CG[:3, 3] += (float(levels.min()) - SEAT_MM) * X_CG[:3, 2]
    return replace(grasp, X_CG=X_CG)


def touch(grasp: Grasp, surface: Surface) -> Touch:
    """What touches of a seated grasp: surface that is parallel to the face, and as near as touching is."""
    parallel = surface.normals @ -grasp.X_CG[:3, 2] >= np.cos(PARALLEL_RAD)
    radius = grasp.opening_width_mm / 2.0
    low, high = np.array([-radius, -radius, -TOUCH_GAP_MM]), np.array([radius, radius, TOUCH_GAP_MM])
    near = surface.within(grasp.X_CG, low, high, parallel)  # (k, 3, 3)
    disc = _disc(radius)
    if not len(near):
        return Touch(beside_mm2=disc.area, gap_mm=np.inf)
    flats = np.asarray(shapely.polygons(near[:, :, :2]))
    covered = shapely.union_all(flats[shapely.area(flats) > 0.0]).buffer(_JOIN_MM)
    return Touch(beside_mm2=float(disc.difference(covered).area), gap_mm=float(near[..., 2].min()))


def sealed(grasp: Grasp, surface: Surface, what: str) -> Touch | Rejection:
    """The touch of a face that lies on flat surface with all of its area, or how much of it does not."""
    found = touch(grasp, surface)
    if found.beside_mm2 > _BESIDE_MM2:
        return Rejection(
            "no-contact",
            f"{found.beside_mm2:.1f} mm² of the {what} of {grasp.opening_width_mm:g} mm would lie beside flat surface, "
            f"on an edge, over a hole or more than {TOUCH_GAP_MM:g} mm off; nothing of it may",
        )
    return found


def thickness_mm(grasp: Grasp, surface: Surface, most_mm: float) -> float:
    """How thick the component is behind the face, at the least, as far as `most_mm`."""
    radius = grasp.opening_width_mm / 2.0 / np.sqrt(2.0)  # the square within the face
    back = surface.normals @ grasp.X_CG[:3, 2] > 0.0
    low, high = np.array([-radius, -radius, TOUCH_GAP_MM]), np.array([radius, radius, most_mm])
    levels = surface.within(grasp.X_CG, low, high, back)[..., 2]
    return float(levels.min()) if levels.size else most_mm


def _before(grasp: Grasp, surface: Surface, reach_mm: float) -> FloatArray:
    """The triangles before the face, as near as that, whose parts lie within its circle, (k, 3, 3)."""
    radius = grasp.opening_width_mm / 2.0
    low, high = np.array([-radius, -radius, -reach_mm]), np.array([radius, radius, reach_mm])
    near = surface.within(grasp.X_CG, low, high, surface.normals @ grasp.X_CG[:3, 2] < 0.0)
    inside = shapely.intersects(shapely.polygons(near[:, :, :2]), _disc(radius)) if len(near) else np.zeros(0, dtype=bool)
    return np.asarray(near[inside])


def _disc(radius: float) -> shapely.Polygon:
    angles = 2.0 * np.pi * np.arange(_CORNERS) / _CORNERS
    return shapely.Polygon(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))
