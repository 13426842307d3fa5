"""Two-finger grasps on nearly parallel facets (paper, section 5.3): pairs that face away from each other and overlap."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import shapely
from pydantic import Field

from gripwright.domain.assembly import Component
from gripwright.domain.grasp import PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.shape import FloatArray, Mesh, Segment
from gripwright.geometry.facets import Facet, facets
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.strips import boundary_edges, strip_ranges
from gripwright.plugin_api import HandModel, Params, RunContext

_PARALLEL_RAD = np.radians(5.0)  # INTERFACE.md: surfaces within 5° of parallel touch

_OUTLINE_MM = 0.05  # by so much a facet's outline may be simplified for planning
_SAME_DEPTH_MM = 1e-6
_DEEPER_MM = np.array([1.0, 2.5])  # past a chamfer or a fillet


class FacetPairSettings(Params):
    """Resolution of the plan."""

    rotation_step: float = Field(15.0, gt=0, le=90, description="degrees between rotations about the contact normal")
    offset_step: float = Field(5.0, gt=0, le=100, description="mm between neighbouring offsets across the facets")
    offsets_max: int = Field(
        7,
        ge=1,
        le=99,
        description="offsets planned at the most for one rotation; what lies between is searched where none is free",
    )
    depths: int = Field(3, ge=1, le=50, description="number of depths of the tips along the facets")
    contact_reserve: float = Field(0.25, ge=0, le=10, description="mm that the tips reach beyond the least contact")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Plan:
    """Grasps on one pair of facets, n of them."""

    opening_mm: float
    rank: FloatArray  # (n,) the best first
    X_CG: FloatArray  # (n, 4, 4)
    turn_rad: FloatArray  # (n,)
    offset_mm: FloatArray  # (n,)
    leeway: FloatArray  # (n, 4, 2), nan: none


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
        if requirement.taper_rad or requirement.vee is not None:
            return []
        width = float(np.ptp(np.concatenate([solid.vertices_mm[:, 1] for solid in hand.finger(10.0, requirement.grip)])))
        clusters = facets(component.mesh, segment.faces, float(_PARALLEL_RAD))
        plans = [
            plan
            for grip_axis in requirement.grip_axes_C
            for first, second in _opposite(clusters, grip_axis, requirement.opening_width_mm)
            if (plan := self._pair(component.mesh, first, second, width, ctx.min_contact_mm)) is not None
        ]
        ranks = np.concatenate([plan.rank for plan in plans]) if plans else np.zeros(0)
        grasps = [grasp for plan in plans for grasp in _grasps(plan, requirement)]
        return [grasps[i] for i in np.argsort(ranks, kind="stable")]

    def _pair(self, mesh: Mesh, first: Facet, second: Facet, width: float, contact: float) -> _Plan | None:
        """Grasps on one pair, all rotations together; None where the facets do not overlap."""
        x = first.normal
        u = any_perpendicular(x)
        v = np.cross(x, u)
        overlap = shapely.intersection(_outline(mesh, first, u, v), _outline(mesh, second, u, v))
        edges = boundary_edges(overlap)
        if len(edges) == 0:
            return None
        turns = self._turns(overlap)
        along = np.stack([np.cos(turns), np.sin(turns)], axis=1)  # (t, 2) approach in (u, v)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        centre = across @ np.asarray(shapely.get_coordinates(shapely.centroid(overlap)))[0]  # (t,)
        offsets, beside = self._offsets(edges[:, 0] @ across.T, centre, width)  # (t, k), (t, k, 2)
        begin, end = np.moveaxis(strip_ranges(edges, along, offsets, width), 2, 0)  # (t, k)
        depths, deeper = self._depths(np.where(end > begin, end - begin, np.nan), contact)  # (t, k, d)
        t, k, d = np.nonzero(np.isfinite(depths))
        offset, depth = offsets[t, k], depths[t, k, d]
        place = along[t] * (begin[t, k] + depth)[:, None] + across[t] * offset[:, None]  # (n, 2)
        opening = first.offset_mm + second.offset_mm
        approach = along @ np.stack([u, v])  # (t, 3)
        leeway = np.zeros((len(t), 4, 2))
        leeway[:, 0] = np.radians(self._params.rotation_step) * np.array([-0.5, 0.5])
        leeway[:, 2], leeway[:, 3, 1] = beside[t, k], deeper[t, k, d]
        origin = (first.offset_mm - opening / 2.0) * x + place @ np.stack([u, v])
        return _Plan(
            opening_mm=opening,
            rank=np.abs(offset - centre[t]) + 0.1 * depth,  # how far off the overlap's middle, then how deep
            X_CG=pose(x, np.cross(approach, x)[t], approach[t], origin),
            turn_rad=turns[t],
            offset_mm=offset,
            leeway=leeway,
        )

    def _turns(self, overlap: shapely.Geometry) -> FloatArray:
        """Rotations: regular ones, and those along the edges of the overlap's least rectangle."""
        corners = np.asarray(shapely.get_coordinates(shapely.minimum_rotated_rectangle(overlap)))
        edge = corners[1] - corners[0] if len(corners) > 1 else np.array([1.0, 0.0])
        start = float(np.arctan2(edge[1], edge[0]))
        return start + np.arange(0.0, 2.0 * np.pi - 1e-9, np.radians(self._params.rotation_step))

    def _offsets(self, aside: FloatArray, centre: FloatArray, width: float) -> tuple[FloatArray, FloatArray]:
        """Offsets of each rotation (t, k), nan where there are fewer; and how far each stands for those beside it, nan: for none.

        `aside` (m, t): where the overlap's corners lie across the approach. Regular offsets, and its `centre`.
        """
        step, most = self._params.offset_step, self._params.offsets_max
        low, high = aside.min(axis=0)[:, None], aside.max(axis=0)[:, None]  # (t, 1)
        reach = np.maximum(0.0, (high - low - width) / 2.0)
        count = np.where(reach > 0.0, np.minimum(most, 1 + 2 * ((high - low) // (2.0 * step))), 1)
        index, gaps = np.arange(most), np.maximum(count - 1, 1)
        share = np.where(count > 1, 2.0 * index / gaps - 1.0, 0.0)  # from −1 to 1
        regular = np.where(index < count, (low + high) / 2.0 + share * reach, np.nan)
        half = np.broadcast_to(reach / gaps, share.shape)
        below, above = np.where(index == 0, step / 2.0, half), np.where(index == count - 1, step / 2.0, half)
        other = np.clip(centre[:, None], low, high)
        other[(np.abs(regular - other) < _OUTLINE_MM).any(axis=1)] = np.nan
        beside = np.concatenate([np.stack([-below, above], axis=2), np.full((len(centre), 1, 2), np.nan)], axis=1)
        return np.column_stack([regular, other]), beside

    def _depths(self, length: FloatArray, contact: float) -> tuple[FloatArray, FloatArray]:
        """Depths of the tips on strips of some length (nan: no strip), (…, d), and how much deeper each stands for, nan: none."""
        length = length[..., None]
        least = np.minimum(length, contact + self._params.contact_reserve)
        index, gaps = np.arange(self._params.depths), max(self._params.depths - 1, 1)
        between = (length - least) / gaps
        regular = np.where((index == 0) | (between > _SAME_DEPTH_MM), least + between * index, np.nan)
        deeper = np.where((index < gaps) & np.isfinite(regular), between, np.nan)
        more = least + _DEEPER_MM
        again = (np.abs(more[..., None] - regular[..., None, :]) < _SAME_DEPTH_MM).any(axis=-1)
        more = np.where((more <= length) & ~again, more, np.nan)
        depths = np.concatenate([regular, more], axis=-1)
        return depths, np.concatenate([deeper, np.full(more.shape, np.nan)], axis=-1)


def _grasps(plan: _Plan, requirement: GripRequirement) -> Iterator[Grasp]:
    """The plan's grasps, in its order."""
    degrees, stands = np.degrees(plan.turn_rad) % 360.0, np.asarray(np.isfinite(plan.leeway).all(axis=(1, 2)))
    aside = np.round(plan.offset_mm, 1) + 0.0  # no minus zero
    for i in range(len(plan.rank)):
        yield Grasp(
            X_CG=plan.X_CG[i],
            gripper_type=requirement.gripper_type,
            grip=requirement.grip,
            opening_width_mm=plan.opening_mm,
            label=f"across {plan.opening_mm:.1f} mm, turned {degrees[i]:.0f}°, {aside[i]:.1f} mm aside",
            leeway=plan.leeway[i] if stands[i] else None,
        )


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
    flat = (mesh.vertices_mm @ np.stack([u, v], axis=1))[mesh.faces[facet.faces]]  # (k, 3, 2)
    outline = shapely.simplify(shapely.coverage_union_all(shapely.polygons(flat)), _OUTLINE_MM)
    return outline if shapely.is_valid(outline) else shapely.make_valid(outline)
