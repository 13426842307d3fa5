"""Positions of a round face on the flat areas of a segment."""

from collections.abc import Iterator, Sequence
from typing import ClassVar

import numpy as np
import shapely
from pydantic import Field
from shapely.ops import nearest_points

from gripwright.domain.assembly import Component
from gripwright.domain.grasp import SURFACE, Grasp, GripRequirement
from gripwright.domain.shape import FloatArray, Mesh, Segment
from gripwright.geometry.facets import Facet, facets
from gripwright.geometry.frames import any_perpendicular, pose
from gripwright.geometry.measures import volume_mm3
from gripwright.plugin_api import HandModel, Params, RunContext
from gripwright_vacuum.gripper_types import MAGNETIC_1, VACUUM_1

_FLAT_RAD = float(np.radians(0.5))
_ALONG = float(np.cos(np.radians(1.0)))  # of an approach direction that a requirement allows


class FlatFaceSettings(Params):
    """Resolution of the plan."""

    rim: float = Field(1.0, ge=0, le=20, description="mm of flat surface around the face, for what it is placed wrong by")
    step: float = Field(10.0, gt=0, le=500, description="mm between neighbouring positions")
    positions_max: int = Field(48, ge=1, le=10_000, description="positions planned at the most on one flat area")


class FlatFacePlanner:
    """Places a round face where all of it lies on a flat area, without holes, the nearest to the centre of mass first.

    The area is divided off the segment; the approach is against its normal. A round face needs no rotations about its axis.
    """

    key: ClassVar[str] = "flat_faces"
    params_model: ClassVar[type[Params]] = FlatFaceSettings
    gripper_types: ClassVar[frozenset[str]] = frozenset({VACUUM_1, MAGNETIC_1})
    grips: ClassVar[frozenset[str]] = frozenset({SURFACE})

    def __init__(self, params: FlatFaceSettings) -> None:
        self._params = params

    def plan(
        self, component: Component, segment: Segment, requirement: GripRequirement, hand: HandModel, ctx: RunContext
    ) -> Sequence[Grasp]:
        """Grasps of every flat area that has room, by their distance from the line of the centre of mass."""
        centre, mesh = _centre_of_mass_C(component.mesh), component.mesh
        found = [
            place
            for facet in facets(mesh, segment.faces, _FLAT_RAD)
            if _is_allowed(-facet.normal, requirement.approach_C)
            for place in self._places(mesh, facet, requirement.opening_width_mm, centre)
        ]
        order = np.argsort([round(off, 6) for off, _ in found], kind="stable")
        return [_grasp(found[i][0], found[i][1], requirement) for i in order]

    def _places(self, mesh: Mesh, facet: Facet, width_mm: float, centre_C: FloatArray) -> Iterator[tuple[float, FloatArray]]:
        """(distance from the line of the centre of mass, pose) of each position."""
        z, x = -facet.normal, any_perpendicular(facet.normal)
        across = np.stack([x, np.cross(z, x)], axis=1)  # (3, 2)
        flat = (mesh.vertices_mm @ across)[mesh.faces[facet.faces]]  # (k, 3, 2)
        room = shapely.coverage_union_all(shapely.polygons(flat)).buffer(-width_mm / 2.0 - self._params.rim)
        if room.is_empty:
            return
        centre = centre_C @ across
        points = self._positions(room, centre)
        distances = np.linalg.norm(points - centre, axis=1)
        for i in np.argsort(distances, kind="stable")[: self._params.positions_max]:
            origin = across @ points[i] + facet.offset_mm * facet.normal
            yield float(distances[i]), pose(x, across[:, 1], z, origin)

    def _positions(self, room: shapely.Geometry, centre: FloatArray) -> FloatArray:
        """The position nearest to the centre of mass, one within every part of the room, and a grid through the first, (n, 2)."""
        nearest = np.array(nearest_points(room, shapely.Point(centre))[0].coords[0])
        inner = [np.array(part.representative_point().coords[0]) for part in getattr(room, "geoms", [room])]
        low, high = shapely.bounds(room).reshape(2, 2)
        step = self._params.step
        steps = [
            np.arange(np.ceil((a - c) / step), np.floor((b - c) / step) + 1.0) for a, b, c in zip(low, high, nearest, strict=True)
        ]
        grid = nearest + step * np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        inside = shapely.contains_xy(room, grid)
        return np.unique(np.round(np.concatenate([[nearest], inner, grid[inside]]), 6), axis=0)


def _is_allowed(approach: FloatArray, allowed_C: FloatArray) -> bool:
    return not len(allowed_C) or bool((allowed_C @ approach).max() >= _ALONG)


def _grasp(off_mm: float, X_CG: FloatArray, requirement: GripRequirement) -> Grasp:
    return Grasp(
        X_CG=X_CG,
        gripper_type=requirement.gripper_type,
        grip=SURFACE,
        opening_width_mm=requirement.opening_width_mm,
        label=f"on the flat face, {off_mm:.1f} mm from the line of the centre of mass",
    )


def _centre_of_mass_C(mesh: Mesh) -> FloatArray:
    """Of the solid with even density; of its corners where the mesh encloses nothing."""
    volume = volume_mm3(mesh)
    if abs(volume) < 1e-9:
        return np.asarray(mesh.vertices_mm.mean(axis=0))
    corners = mesh.triangles_mm  # (m, 3, 3)
    return np.asarray(np.linalg.det(corners) @ corners.sum(axis=1) / 24.0 / volume)
