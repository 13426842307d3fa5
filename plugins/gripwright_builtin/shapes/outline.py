"""The outline of a profile, seen along its axis: a polygon of corners and straight edges. Lengths in mm."""

from collections.abc import Sequence

import numpy as np
import shapely

from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.facets import Facet

_SIMPLE = 1e-3  # share of the size by which corners may lie off
_ALIKE = 0.97  # share that outlines of both ends have in common
_FACET_RAD = float(np.radians(40.0))  # a round outline has nine facets or more
_ROUND = 0.01  # share of the radius by which the corners of a round outline may lie off


def outline_of(ends: Sequence[Sequence[Facet]], sides: IntArray, flat: FloatArray, faces: IntArray) -> FloatArray | str:
    """Corners (k, 2), counter-clockwise, or why there is no outline.

    `ends`: the facets of the two end faces; `sides` (s, 3): triangles along the axis; `flat` (n, 2): the mesh's vertices
    seen along the axis; `faces` (m, 3): its triangles.
    """
    areas = [_largest(shapely.union_all(shapely.polygons(flat[faces[_faces(end)]]))) for end in ends if end]
    found = [area for area in areas if area is not None]
    if len(found) == 2:
        common = shapely.area(shapely.intersection(found[0], found[1])) / max(shapely.area(found[0]), shapely.area(found[1]))
        if common < _ALIKE:
            return f"its ends have {100 * common:.1f} % in common, at least {100 * _ALIKE:.1f} %"
    if not found:
        side = _largest(shapely.unary_union(list(shapely.polygonize(list(shapely.get_parts(_lines(flat[sides])))).geoms)))
        if side is None:
            return "its sides leave the outline open"
        found = [side]
    largest = max(found, key=shapely.area)
    size = float(np.ptp(shapely.get_coordinates(largest), axis=0).max())
    ring = shapely.get_coordinates(shapely.simplify(largest, _SIMPLE * size).exterior)[:-1]
    return np.asarray(ring if signed_area(ring) > 0.0 else ring[::-1])


def _faces(end: Sequence[Facet]) -> IntArray:
    return np.concatenate([facet.faces for facet in end])


def _largest(area: shapely.Geometry) -> shapely.Polygon | None:
    """The largest polygon of an area, without its holes."""
    parts = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and part.area > 0.0]
    return shapely.Polygon(max(parts, key=shapely.area).exterior) if parts else None


def _lines(triangles: FloatArray) -> shapely.Geometry:
    """Triangles that are seen from the edge, as lines, their ends snapped together."""
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    size = float(np.ptp(triangles.reshape(-1, 2), axis=0).max())
    lines = shapely.linestrings(edges[length > _SIMPLE * size])
    return shapely.unary_union(shapely.set_precision(lines, _SIMPLE * size / 2.0))


def signed_area(ring: FloatArray) -> float:
    """Positive for counter-clockwise corners (k, 2)."""
    x, y = ring.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2.0)


def rectangle_share(ring: FloatArray) -> float:
    """Share of its least rectangle that an outline fills, 0..1."""
    polygon = shapely.Polygon(ring)
    return float(polygon.area / shapely.minimum_rotated_rectangle(polygon).area)


def is_round(ring: FloatArray) -> bool:
    """Whether an outline is a tessellated circle: its corners lie on one, and no edge is longer than a facet."""
    middle = shapely.get_coordinates(shapely.minimum_bounding_circle(shapely.Polygon(ring)).centroid)[0]
    distances = np.linalg.norm(ring - middle, axis=1)
    edges = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    radius = float(distances.max())
    return bool(np.ptp(distances) <= _ROUND * radius and edges.max() <= 2.05 * radius * np.sin(_FACET_RAD / 2.0))


def edges_of(ring: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Begin (k, 2), end (k, 2) and outward unit normal (k, 2) of each edge of a counter-clockwise outline."""
    end = np.roll(ring, -1, axis=0)
    step = end - ring
    return ring, end, np.stack([step[:, 1], -step[:, 0]], axis=1) / np.linalg.norm(step, axis=1, keepdims=True)


def nearest_edge(ring: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance of points (n, 2) from an outline, (n,), and the outward normal of the nearest edge, (n, 2)."""
    begin, end, normals = edges_of(ring)
    best, facing = np.full(len(points), np.inf), np.zeros((len(points), 2))
    for a, b, normal in zip(begin, end, normals, strict=True):
        step = b - a
        share = np.clip((points - a) @ step / (step @ step), 0.0, 1.0)
        distance = np.linalg.norm(points - a - share[:, None] * step, axis=1)
        closer = distance < best
        best[closer], facing[closer] = distance[closer], normal
    return best, facing
