"""Meshes built by code, for tests. Lengths in mm."""

import itertools

import manifold3d
import numpy as np
from scipy.spatial.transform import Rotation

from gripwright.domain.assembly import IDENTITY, Component
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.frames import transform

STEPPED_SHAFT = ((0.0, 0.0), (10.0, 0.0), (10.0, 20.0), (5.0, 20.0), (5.0, 45.0), (0.0, 45.0))
SIX_STEPS = (
    (0.0, 0.0), (8.0, 0.0), (8.0, 25.0), (14.0, 25.0), (14.0, 45.0), (22.0, 45.0), (22.0, 60.0),
    (30.0, 60.0), (30.0, 70.0), (15.0, 70.0), (15.0, 90.0), (25.0, 90.0), (25.0, 100.0), (0.0, 100.0),
)  # fmt: skip


def box_mesh(extents: tuple[float, float, float]) -> Mesh:
    """A box of 12 triangles, one corner at the origin."""
    return mesh_of(manifold3d.Manifold.cube(extents))


def sphere_mesh(radius: float, segments: int) -> Mesh:
    return mesh_of(manifold3d.Manifold.sphere(radius, segments))


def turned_mesh(profile: tuple[tuple[float, float], ...], sections: int, ring_mm: float = np.inf) -> Mesh:
    """A profile of (radius, z), from axis to axis, turned about z; long steps are divided into rings of `ring_mm`."""
    points = [profile[0]]
    for (r0, z0), (r1, z1) in itertools.pairwise(profile):
        parts = max(1, int(np.ceil(np.hypot(r1 - r0, z1 - z0) / ring_mm)))
        points += [(r0 + (r1 - r0) * k / parts, z0 + (z1 - z0) * k / parts) for k in range(1, parts + 1)]
    angle = 2.0 * np.pi * np.arange(sections) / sections
    rings = [[p] * sections for p in points]
    vertices = np.array([(r * np.cos(a), r * np.sin(a), z) for ring in rings for (r, z), a in zip(ring, angle, strict=True)])
    k = np.arange(sections)
    faces = []
    for ring in range(len(points) - 1):
        low, high = ring * sections, (ring + 1) * sections
        a, b, c, d = low + k, low + (k + 1) % sections, high + (k + 1) % sections, high + k
        if points[ring][0] > 0:
            faces.append(np.stack((a, b, c if points[ring + 1][0] > 0 else d), axis=1))
        if points[ring + 1][0] > 0:
            faces.append(np.stack((a, c, d), axis=1))
    return Mesh(vertices_mm=vertices, faces=np.concatenate(faces).astype(np.int64))


def plate_with_bosses(sections: int) -> Mesh:
    """A plate 80 × 50 × 8 with two bosses of radius 8, 20 high, and a bore of radius 10 between them."""
    solid = manifold3d.Manifold.cube((80.0, 50.0, 8.0))
    for x in (15.0, 65.0):
        solid += manifold3d.Manifold.cylinder(24.0, 8.0, 8.0, sections).translate((x, 25.0, 4.0))
    return mesh_of(solid - manifold3d.Manifold.cylinder(20.0, 10.0, 10.0, sections).translate((40.0, 25.0, -5.0)))


def housing(sections: int) -> Mesh:
    """A box 80 × 60 × 40, hollow from above but for walls of 4, with a bearing seat (radius 15, bore 10) on one side."""
    solid = manifold3d.Manifold.cube((80.0, 60.0, 40.0)) - manifold3d.Manifold.cube((72.0, 52.0, 40.0)).translate((4.0, 4.0, 4.0))
    upright = manifold3d.Manifold.cylinder(14.0, 15.0, 15.0, sections) - manifold3d.Manifold.cylinder(
        40.0, 10.0, 10.0, sections
    ).translate((0, 0, -20.0))
    seat = upright.rotate((0.0, 90.0, 0.0)).translate((78.0, 30.0, 20.0))
    bore = manifold3d.Manifold.cylinder(20.0, 10.0, 10.0, sections).rotate((0.0, 90.0, 0.0)).translate((70.0, 30.0, 20.0))
    return mesh_of(solid - bore + (seat - manifold3d.Manifold.cube((72.0, 52.0, 40.0)).translate((4.0, 4.0, 4.0))))


def filleted_boss(sections: int) -> Mesh:
    """A disc of radius 30 with a boss of radius 10 on it; a fillet of radius 4 leads from one to the other."""
    arc = np.linspace(0.0, np.pi / 2.0, sections // 4 + 1)
    fillet = tuple((14.0 - 4.0 * np.sin(a), 12.0 - 4.0 * np.cos(a)) for a in arc)
    return turned_mesh(((0.0, 0.0), (30.0, 0.0), (30.0, 8.0), *fillet, (10.0, 40.0), (0.0, 40.0)), sections)


def plate_with_low_bosses(sections: int) -> Mesh:
    """A plate 100 × 100 × 8 with nine bosses of radius 8 that stand out by 1: hardly thicker than the plate, and small."""
    solid = manifold3d.Manifold.cube((100.0, 100.0, 8.0))
    for x in (20.0, 50.0, 80.0):
        for y in (20.0, 50.0, 80.0):
            solid += manifold3d.Manifold.cylinder(5.0, 8.0, 8.0, sections).translate((x, y, 4.0))
    return mesh_of(solid)


def soup(mesh: Mesh) -> Mesh:
    """The same triangles as an STL file has them: no shared vertices."""
    return Mesh(vertices_mm=mesh.triangles_mm.reshape(-1, 3), faces=np.arange(3 * len(mesh.faces)).reshape(-1, 3))


def moved(mesh: Mesh, X_AB: FloatArray) -> Mesh:
    return Mesh(vertices_mm=transform(X_AB, mesh.vertices_mm), faces=mesh.faces, source_faces=mesh.source_faces)


def component_of(mesh: Mesh) -> Component:
    return Component(id="component", mesh=mesh, X_PC=IDENTITY)


def mesh_of(solid: manifold3d.Manifold) -> Mesh:
    """The surface of a solid."""
    found = solid.to_mesh64()
    return Mesh(vertices_mm=np.array(found.vert_properties[:, :3], dtype=float), faces=np.array(found.tri_verts, dtype=np.int64))


def turned_pose(seed: int) -> FloatArray:
    """Some pose, turned and moved."""
    rng = np.random.default_rng(seed)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3) * 40
    return X
