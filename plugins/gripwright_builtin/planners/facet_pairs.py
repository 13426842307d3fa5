"""Two-finger grasps on nearly parallel facets (paper, section 5.3): pairs that face away from each other and overlap."""

from collections.abc import Iterator, Sequence
from typing import ClassVar

import numpy as np
import shapely
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.grasp import PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.shape import FloatArray, Mesh, Segment
from gripwright.geometry.facets import Facet, facets
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.plugin_api import HandModel, Params, RunContext

_PARALLEL_RAD = np.radians(5.0)  # INTERFACE.md: surfaces within 5° of parallel touch

_OUTLINE_MM = 0.05  # by so much a facet's outline may be simplified for planning


class FacetPairSettings(Params):
    """Resolution of the plan."""

    rotation_step: float = Field(15.0, gt=0, le=90, description="degrees between rotations about the contact normal")
    offset_step: float = Field(5.0, gt=0, le=100, description="mm between neighbouring offsets across the facets")
    offsets_max: int = Field(7, ge=1, le=99, description="offsets tried at the most for one rotation")
    depths: int = Field(3, ge=1, le=50, description="number of depths of the tips along the facets")
    contact_reserve: float = Field(0.25, ge=0, le=10, description="mm that the tips reach beyond the least contact")


class FacetPairPlanner:
    """Clusters the segment into facets, pairs them, and turns the gripper about the contact normal."""

    key: ClassVar[str] = "facet_pairs"
    params_model: ClassVar[type[Params]] = FacetPairSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({PARALLEL_2})

    def __init__(self, params: FacetPairSettings) -> None:
        self._params = params

    def plan(
        self, component: Component, segment: Segment, requirement: GripRequirement, hand: HandModel, ctx: RunContext
    ) -> Sequence[Grasp]:
        """Grasps of every pair, the central and shallow ones first."""
        width = float(np.ptp(np.concatenate([solid.vertices_mm[:, 1] for solid in hand.finger(10.0, requirement.grip)])))
        ranked: list[tuple[float, Grasp]] = []
        clusters = facets(component.mesh, segment.faces, float(_PARALLEL_RAD))
        for grip_axis in requirement.grip_axes_C:
            for first, second in _opposite(clusters, grip_axis, requirement.opening_width_mm):
                ranked.extend(self._pair(component.mesh, first, second, requirement, width, ctx.min_contact_mm))
        ranked.sort(key=lambda item: item[0])
        return [grasp for _, grasp in ranked]

    def _pair(
        self, mesh: Mesh, first: Facet, second: Facet, requirement: GripRequirement, width: float, contact: float
    ) -> Iterator[tuple[float, Grasp]]:
        """Grasps on one pair with their rank: how far off the overlap's middle, then how deep."""
        x = first.normal
        u = any_perpendicular(x)
        v = np.cross(x, u)
        overlap = shapely.intersection(_outline(mesh, first, u, v), _outline(mesh, second, u, v))
        if shapely.area(overlap) <= 0.0:
            return
        opening = first.offset_mm + second.offset_mm
        middle = first.offset_mm - opening / 2.0
        for turn in self._turns(overlap):
            along = np.array([np.cos(turn), np.sin(turn)])  # approach in (u, v)
            across = np.array([-along[1], along[0]])
            approach = along[0] * u + along[1] * v
            y = np.cross(approach, x)
            for rank, offset, tips in self._strips(overlap, along, across, width, contact):
                place = along * tips + across * offset
                yield (
                    rank,
                    Grasp(
                        X_CG=pose(x, y, approach, middle * x + place[0] * u + place[1] * v),
                        gripper_type=requirement.gripper_type,
                        grip=requirement.grip,
                        opening_width_mm=opening,
                        label=f"across {opening:.1f} mm, turned {np.degrees(turn) % 360.0:.0f}°, {offset:.1f} mm aside",
                    ),
                )

    def _turns(self, overlap: shapely.Geometry) -> FloatArray:
        """Rotations: regular ones, and those along the edges of the overlap's least rectangle."""
        corners = np.asarray(shapely.get_coordinates(shapely.minimum_rotated_rectangle(overlap)))
        edge = corners[1] - corners[0] if len(corners) > 1 else np.array([1.0, 0.0])
        start = float(np.arctan2(edge[1], edge[0]))
        return start + np.arange(0.0, 2.0 * np.pi - 1e-9, np.radians(self._params.rotation_step))

    def _strips(
        self, overlap: shapely.Geometry, along: FloatArray, across: FloatArray, width: float, contact: float
    ) -> Iterator[tuple[float, float, float]]:
        """(rank, offset across, level of the tips along) for each strip of the finger's width over the overlap."""
        points = np.asarray(shapely.get_coordinates(overlap))
        low, high = float((points @ across).min()), float((points @ across).max())
        centre = np.asarray(shapely.get_coordinates(shapely.centroid(overlap)))[0] @ across
        count = int(min(self._params.offsets_max, 1 + 2 * ((high - low) // (2.0 * self._params.offset_step))))
        reach = max(0.0, (high - low - width) / 2.0)
        aside = np.unique(np.round(np.append(np.linspace(-reach, reach, count), 0.0), 6))
        middles = (low + high) / 2.0 + aside
        offsets = np.unique(np.round(np.append(middles, np.clip(centre, low, high)), 3))
        for offset, (begin, end) in zip(offsets, _strip_ranges(overlap, along, across, offsets, width), strict=True):
            length = end - begin
            if length <= 0.0:
                continue
            least = min(length, contact + self._params.contact_reserve)
            depths = np.unique(
                np.round(np.append(np.linspace(least, length, self._params.depths), [least + 1.0, least + 2.5]), 6)
            )
            for depth in depths[depths <= length + 1e-9]:
                yield abs(float(offset - centre)) + 0.1 * float(depth), float(offset), begin + float(depth)


def _opposite(clusters: Sequence[Facet], grip_axis: FloatArray, opening_mm: float) -> Iterator[tuple[Facet, Facet]]:
    """Pairs of facets across `grip_axis` that face away from each other, about as far apart as the requirement says."""
    limit = float(np.cos(_PARALLEL_RAD))
    ahead = [facet for facet in clusters if facet.normal @ grip_axis >= limit]
    behind = [facet for facet in clusters if facet.normal @ grip_axis <= -limit]
    if not ahead or not behind:
        return
    apart = np.add.outer([facet.offset_mm for facet in ahead], [facet.offset_mm for facet in behind])  # (a, b)
    for i, j in np.argwhere((apart > 0.0) & (np.abs(apart - opening_mm) <= 0.02 * opening_mm + 0.5)):
        if ahead[i].normal @ behind[j].normal <= -limit:
            yield ahead[i], behind[j]


def _outline(mesh: Mesh, facet: Facet, u: FloatArray, v: FloatArray) -> shapely.Geometry:
    """The facet seen along its normal, in coordinates (u, v), mm; its triangles share whole edges."""
    flat = mesh.triangles_mm[facet.faces] @ np.stack([u, v], axis=1)  # (k, 3, 2)
    outline = shapely.simplify(shapely.coverage_union_all(shapely.polygons(flat)), _OUTLINE_MM)
    return outline if shapely.is_valid(outline) else shapely.make_valid(outline)


def _strip_ranges(
    overlap: shapely.Geometry, along: FloatArray, across: FloatArray, offsets: FloatArray, width: float
) -> FloatArray:
    """Where the overlap begins and ends along the approach within strips of the finger's width; (0, 0) where one misses it."""
    far = 1e6
    sides = np.stack([offsets - width / 2.0, offsets + width / 2.0], axis=1)[:, [0, 0, 1, 1], None]  # (k, 4, 1)
    corners = far * np.array([-1.0, 1.0, 1.0, -1.0])[:, None] * along + sides * across  # (k, 4, 2)
    points, strip = shapely.get_coordinates(shapely.intersection(overlap, shapely.polygons(corners)), return_index=True)
    level = points @ along
    result = np.zeros((len(offsets), 2))
    for k in np.unique(strip):
        result[k] = level[strip == k].min(), level[strip == k].max()
    return result
