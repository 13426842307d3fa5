"""The yardstick of `bench_grasps`: antipodal grasps as assembly planners, WRS among them, find them from samples of the surface.

Points are drawn on the surface, a ray inwards from each finds the point opposite, and every pair of contacts whose normals
oppose each other is tried at regular rotations about its line; the gripper's meshes are then checked against the object's
whole mesh by FCL. Two ways: `kept`, everything that can be kept between checks is kept (hierarchies, collision objects,
directions; the rays' tree); otherwise each check builds the hierarchies of the meshes that it compares anew.
"""

from collections.abc import Callable
from dataclasses import dataclass

import fcl
import numpy as np
import trimesh

from gripwright.domain.shape import FloatArray, Mesh

OPPOSED_RAD = np.radians(175.0)
ROTATION_RAD = np.radians(15.0)
APART_MM = 1.0  # neighbouring contacts are farther apart than this
OFF_MM = 1.0  # the fingers stand off the contact by this


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """How many grasps were tried, and how many of them are free."""

    tried: int
    free: int


def plan(mesh: Mesh, finger: Mesh, palm: Mesh, samples: int, opening_max_mm: float, seed: int, kept: bool) -> Planned:
    """Grasps of a 2-finger gripper, `finger` in its own frame, `palm` in the gripper's."""
    surface = trimesh.Trimesh(vertices=mesh.vertices_mm, faces=mesh.faces, process=False)
    hits = _checks(mesh, finger, palm, kept)
    tried = free = 0
    for first, second, normal in _pairs(surface, samples, opening_max_mm, seed):
        width = float(np.linalg.norm(second - first)) + 2.0 * OFF_MM
        middle = (first + second) / 2.0
        side = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        side /= np.linalg.norm(side)
        for turn in np.arange(0.0, 2.0 * np.pi - 1e-9, ROTATION_RAD):
            approach = np.cos(turn) * side + np.sin(turn) * np.cross(normal, side)
            rotation = np.column_stack([normal, np.cross(approach, normal), approach])
            mirrored = np.column_stack([-normal, -np.cross(approach, normal), approach])
            tried += 1
            places = [
                fcl.Transform(rotation, middle + normal * width / 2.0),
                fcl.Transform(mirrored, middle - normal * width / 2.0),
                fcl.Transform(rotation, middle),
            ]
            free += not any(hits(part, place) for part, place in enumerate(places))
    return Planned(tried=tried, free=free)


def _pairs(
    surface: trimesh.Trimesh, samples: int, opening_max_mm: float, seed: int
) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Contacts that face away from each other, and the outward normal of the first."""
    points, faces = trimesh.sample.sample_surface(surface, samples, seed=seed)
    normals = surface.face_normals
    found: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for point, face in zip(points, faces, strict=True):
        if any(np.linalg.norm(point - first) < APART_MM for first, _, _ in found):
            continue
        normal = normals[face]
        hits, _, opposite = surface.ray.intersects_location([point - 1e-3 * normal], [-normal], multiple_hits=True)
        for hit, other in zip(hits, opposite, strict=True):
            apart = float(np.linalg.norm(hit - point))
            if normals[other] @ normal <= np.cos(OPPOSED_RAD) and 1e-2 < apart <= opening_max_mm:
                found.append((point, hit, normal))
    return found


def _checks(mesh: Mesh, finger: Mesh, palm: Mesh, kept: bool) -> Callable[[int, fcl.Transform], bool]:
    """Whether a part of the gripper (0, 1: a finger, 2: the palm) hits the object at a place."""
    parts = (finger, finger, palm)
    made = [fcl.CollisionObject(_bvh(part)) for part in parts]
    standing = fcl.CollisionObject(_bvh(mesh))

    def hits(part: int, place: fcl.Transform) -> bool:
        moving = made[part] if kept else fcl.CollisionObject(_bvh(parts[part]))
        moving.setTransform(place)
        against = standing if kept else fcl.CollisionObject(_bvh(mesh))
        return bool(fcl.collide(moving, against, fcl.CollisionRequest(), fcl.CollisionResult()))

    return hits


def _bvh(mesh: Mesh) -> fcl.BVHModel:
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices_mm), len(mesh.faces))
    model.addSubModel(mesh.vertices_mm, mesh.faces)
    model.endModel()
    return model
