"""Solids of one shape each, made by code, with what they were made with. Lengths in mm; axes along z, through the origin."""

import manifold3d
import numpy as np
from scipy.spatial.transform import Rotation

from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.refine import refine
from mesh_factory import mesh_of, moved

Manifold = manifold3d.Manifold


def cone(radius: float, top: float, height: float, sections: int) -> Manifold:
    """A frustum of a cone, its apex where `top` is 0."""
    return Manifold.cylinder(height, radius, top, sections)


def conical_bore(radius: float, top: float, height: float, sections: int) -> Manifold:
    """A block with a conical bore right through it."""
    block = Manifold.cube((3.0 * radius, 3.0 * radius, height)).translate((-1.5 * radius, -1.5 * radius, 0.0))
    slope = (top - radius) / height
    return block - Manifold.cylinder(height + 2.0, radius - slope, top + slope, sections).translate((0.0, 0.0, -1.0))


def polygon(sides: int, across: float) -> FloatArray:
    """A regular polygon with an inscribed circle of that diameter, its first side facing along x."""
    angle = 2.0 * np.pi * (np.arange(sides) - 0.5) / sides
    return across / 2.0 / np.cos(np.pi / sides) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def pyramid(sides: int, across: float, top: float, height: float) -> Manifold:
    """A frustum of a regular pyramid, its apex where `top` is 0; a prism where it is `across`."""
    outline = manifold3d.CrossSection([polygon(sides, across)])
    return Manifold.extrude(outline, height, scale_top=(top / across, top / across))


def zone(radius: float, low: float, high: float, sections: int) -> Manifold:
    """A sphere, what lies below `low` and above `high` cut off."""
    turns = np.linspace(np.arcsin(low / radius), np.arcsin(high / radius), sections // 2 + 1)
    curve = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    curve[np.abs(curve[:, 0]) < 1e-9, 0] = 0.0
    ends = np.array([[0.0, high], [0.0, low]])[[curve[-1, 0] > 0.0, curve[0, 0] > 0.0]]
    return Manifold.revolve(manifold3d.CrossSection([np.concatenate([curve, ends])]), sections)


def torus(major: float, minor: float, arc_deg: float, sections: int) -> Manifold:
    """A tube about an arc, from x on."""
    turn = 2.0 * np.pi * np.arange(sections // 2) / (sections // 2)
    circle = np.stack([major + minor * np.cos(turn), minor * np.sin(turn)], axis=1)
    return Manifold.revolve(manifold3d.CrossSection([circle]), sections, arc_deg)


def profile(outline: list[tuple[float, float]] | FloatArray, height: float) -> Manifold:
    """An outline, counter-clockwise, led along z."""
    return Manifold.extrude(manifold3d.CrossSection([np.asarray(outline)]), height)


def d_shaft(radius: float, flat: float, sections: int = 48) -> FloatArray:
    """A circle with a flat at that distance from its centre."""
    half = np.arccos(flat / radius)
    angle = np.linspace(half, 2.0 * np.pi - half, sections)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def slot(length: float, width: float, sections: int = 24) -> FloatArray:
    """A key: two half circles and two straight sides."""
    angle = np.linspace(-np.pi / 2.0, np.pi / 2.0, sections)
    shift = np.array([(length - width) / 2.0, 0.0])
    end = width / 2.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([end + shift, -end - shift])


def turned_pose(seed: int) -> FloatArray:
    """Any pose."""
    rng = np.random.default_rng(seed)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3) * 30.0
    return X


def surface(solid: Manifold, X: FloatArray | None = None, *, factor: float = 1.0, edge: float | None = None) -> Mesh:
    """The mesh of a solid, as `placed` says."""
    return placed(mesh_of(solid), X, factor=factor, edge=edge)


def placed(mesh: Mesh, X: FloatArray | None = None, *, factor: float = 1.0, edge: float | None = None) -> Mesh:
    """The mesh at `factor` times the size, divided to edges of that share of its extent, moved."""
    mesh = Mesh(vertices_mm=mesh.vertices_mm * factor, faces=mesh.faces)
    if edge is not None:
        mesh = refine(mesh, edge * float(np.ptp(mesh.vertices_mm, axis=0).max()))
    return mesh if X is None else moved(mesh, X)


def rough(mesh: Mesh, share: float, seed: int = 0) -> Mesh:
    """The mesh with every vertex thrown off, by a normal deviation of that share of the extent."""
    size = float(np.ptp(mesh.vertices_mm, axis=0).max())
    noise = np.random.default_rng(seed).normal(scale=share * size, size=mesh.vertices_mm.shape)
    return Mesh(vertices_mm=mesh.vertices_mm + noise, faces=mesh.faces)
