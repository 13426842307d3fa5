"""Boxes: the oriented bounding box, its axes on real faces where that costs hardly any volume (paper, section 4.2)."""

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial import ConvexHull, QhullError

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Box, FloatArray, Mesh, Segment
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.measures import face_areas_mm2, face_normals
from gripwright.plugin_api import Params, RunContext

_DIRECTIONS = 12  # face directions tried as a box axis, the largest by area
_EDGES = 3  # of the outline across it, the longest that give the smallest rectangle
_BOXES = 6  # smallest boxes whose faces are looked at


class BoxParams(Params):
    """What counts as a box that can be held."""

    filled_min: float = Field(0.1, gt=0, le=1, description="Share of a box face's area from which it counts as filled.")
    face_angle: float = Field(5.0, gt=0, le=30, description="Largest angle between a surface and the box face it fills, degrees.")
    face_depth: float = Field(
        0.002, gt=0, le=0.1, description="Largest depth of a surface below its box face, share of the diagonal."
    )
    volume_slack: float = Field(0.03, ge=0, description="Excess of volume accepted for axes that lie on the segment's own faces.")


class BoxFitter:
    """Fits the oriented bounding box of a segment and says how far each of its faces is filled with surface."""

    key: ClassVar[str] = "box"
    params_model: ClassVar[type[BoxParams]] = BoxParams

    def __init__(self, params: BoxParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Box | Rejection:
        """The smallest box, or a hardly larger one whose faces are better filled; `no-box` for a flat segment."""
        part = Mesh(vertices_mm=component.mesh.vertices_mm, faces=component.mesh.faces[segment.faces])
        points = part.vertices_mm[np.unique(part.faces)]
        try:
            hull = ConvexHull(points)
        except QhullError:
            return Rejection("no-box", "the segment is flat, there is no thickness to grip")
        corners = points[hull.vertices]
        rotations = list(_orientations(corners, hull.equations[:, :3], part))
        volumes = np.array([np.prod(np.ptp(corners @ R, axis=0)) for R in rotations])
        order = np.argsort(volumes, kind="stable")
        good = [k for k in order[:_BOXES] if volumes[k] <= volumes.min() * (1.0 + self._params.volume_slack)]
        triangles, normals, areas = part.triangles_mm, face_normals(part), face_areas_mm2(part)
        boxes = [self._box(corners, triangles, normals, areas, rotations[k]) for k in good]
        return max(boxes, key=lambda box: (round(float(box.filled.sum()), 6), -box.volume_mm3))

    def _box(self, corners: FloatArray, triangles_mm: FloatArray, normals_C: FloatArray, areas: FloatArray, R: FloatArray) -> Box:
        local = corners @ R
        low, high = local.min(axis=0), local.max(axis=0)
        extents = high - low
        normals = normals_C @ R
        depth_max = self._params.face_depth * float(np.linalg.norm(extents))
        filled, squares, weight = np.zeros(6), 0.0, 0.0
        for side in range(6):
            k, sign = side // 2, 1.0 if side % 2 else -1.0
            facing = np.flatnonzero(normals[:, k] * sign >= np.cos(np.radians(self._params.face_angle)))
            depth = np.abs(triangles_mm[facing] @ R[:, k] - (high[k] if sign > 0 else low[k])).max(axis=1)
            on, depth = facing[depth <= depth_max], depth[depth <= depth_max]
            filled[side] = min(float(areas[on] @ np.abs(normals[on, k])) * extents[k] / float(np.prod(extents)), 1.0)
            squares += float(areas[on] @ depth**2)
            weight += float(areas[on].sum())
        return Box(
            X_CB=pose(R[:, 0], R[:, 1], R[:, 2], R @ ((low + high) / 2.0)),
            extents_mm=extents,
            filled=filled,
            filled_min=self._params.filled_min,
            rms_mm=float(np.sqrt(squares / weight)) if weight > 0 else 0.0,
        )


def _orientations(corners: FloatArray, hull_normals: FloatArray, part: Mesh) -> Iterator[FloatArray]:
    """Rotations (box axes as columns): one axis a face direction of segment or hull, another an edge of the outline across it."""
    for z in _directions(part, hull_normals):
        x = any_perpendicular(z)
        y = np.cross(z, x)
        flat = np.stack([corners @ x, corners @ y], axis=1)
        try:
            outline = flat[ConvexHull(flat).vertices]
        except QhullError:
            continue
        edges = np.roll(outline, -1, axis=0) - outline
        edges /= np.linalg.norm(edges, axis=1, keepdims=True)
        along, across = outline @ edges.T, outline @ np.stack([-edges[:, 1], edges[:, 0]])  # (o, e) each
        areas = np.ptp(along, axis=0) * np.ptp(across, axis=0)
        lengths = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
        for k in np.lexsort([-lengths, np.rint(areas / areas.min() * 100.0)])[:_EDGES]:
            first = edges[k, 0] * x + edges[k, 1] * y
            yield np.stack([first, np.cross(z, first), z], axis=1)


def _directions(part: Mesh, hull_normals: FloatArray) -> list[FloatArray]:
    """Face directions of the segment by area, opposite ones as one; hull normals make up for segments without planes."""
    normals, areas = face_normals(part), face_areas_mm2(part)
    candidates = np.concatenate([normals[np.argsort(-areas, kind="stable")], hull_normals])
    weights = np.concatenate([np.sort(areas)[::-1], np.zeros(len(hull_normals))])
    axis = np.argmax(np.abs(candidates) > 0.5, axis=1)
    upright = candidates * np.sign(candidates[np.arange(len(candidates)), axis])[:, None]
    _, first, inverse = np.unique(np.rint(upright * 200.0), axis=0, return_index=True, return_inverse=True)
    total = np.bincount(inverse.ravel(), weights)
    kept = first[np.argsort(-total, kind="stable")[:_DIRECTIONS]]
    return [candidates[k] / np.linalg.norm(candidates[k]) for k in kept if np.linalg.norm(candidates[k]) > 0.5]
