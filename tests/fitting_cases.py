"""Generated surfaces with a known cylinder, and what their noise lets any method know of it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from gripwright.domain.assembly import Component
from gripwright.domain.shape import FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.measures import face_areas_mm2

ARCS_DEG = (20, 30, 45, 60, 90, 120, 180, 240, 300, 360)
KINDS = ("plain", "chamfer", "fillet", "caps", "solid")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FittingCase:
    """A mesh whose lateral surface is a cylinder of known radius and axis."""

    kind: str
    mesh: Mesh
    radius_mm: float
    axis: FloatArray
    centre_mm: FloatArray
    height_mm: float
    arc_deg: float
    bore: bool
    noise: float  # standard deviation of the vertices, as a share of the radius
    outliers: float  # share of vertices thrown off
    radius_bound: float  # Cramér–Rao: least standard error of the radius, as a share of it
    axis_bound_rad: float
    profile: FloatArray  # (rows, 2) radius and z of the unit case
    columns: int


def whole_segment(mesh: Mesh) -> tuple[Component, Segment]:
    """A component of this mesh and all of it as one segment."""
    faces = np.arange(len(mesh.faces))
    return Component(id="case", mesh=mesh, X_PC=np.eye(4)), segment_of(mesh, faces)


def segment_of(mesh: Mesh, faces: IntArray) -> Segment:
    """Some faces as a segment."""
    try:
        volume = float(ConvexHull(mesh.vertices_mm[np.unique(mesh.faces[faces])]).volume)
    except QhullError:
        volume = 0.0
    return Segment(id=0, faces=faces, area_mm2=float(face_areas_mm2(mesh)[faces].sum()), hull_volume_mm3=volume)


def revolved(profile: FloatArray, arc_rad: float, columns: int) -> Mesh:
    """A profile of (radius, z) points swept about z; closed to a ring at a full turn. Faces look outwards as z grows."""
    angles = np.linspace(0.0, arc_rad, columns + 1)
    closed = abs(arc_rad - 2.0 * np.pi) < 1e-9
    if closed:
        angles = angles[:-1]
    rows = len(profile)
    points = np.stack(
        [
            np.outer(np.cos(angles), profile[:, 0]),
            np.outer(np.sin(angles), profile[:, 0]),
            np.broadcast_to(profile[:, 1], (len(angles), rows)),
        ],
        axis=2,
    ).reshape(-1, 3)
    column, row = np.meshgrid(np.arange(columns), np.arange(rows - 1), indexing="ij")
    after = (column + 1) % len(angles)
    a, b, c, d = column * rows + row, after * rows + row, after * rows + row + 1, column * rows + row + 1
    faces = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3)
    return Mesh(vertices_mm=points, faces=faces.astype(np.int64))


def random_rotation(rng: np.random.Generator) -> FloatArray:
    """Uniformly random."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q * np.sign(np.linalg.det(Q)))


def make_case(rng: np.random.Generator) -> FittingCase:
    """Any arc, boss or bore, feature, noise, outliers, pose and unit."""
    arc = float(np.radians(rng.choice(ARCS_DEG)))
    height, bore, kind = float(rng.uniform(0.3, 3.0)), bool(rng.random() < 0.5), str(rng.choice(KINDS))
    columns = max(3, round(arc / np.radians(rng.uniform(3.0, 15.0))))
    profile = _profile(kind, height, -1.0 if bore else 1.0, int(rng.integers(2, 16)))
    noise, outliers = float(rng.choice([0.0, 0.0, 0.002, 0.005, 0.01])), float(rng.choice([0.0, 0.0, 0.05]))
    return case_of(kind, profile, arc, columns, height, bore, noise, outliers, rng)


def case_of(
    kind: str,
    profile: FloatArray,
    arc: float,
    columns: int,
    height: float,
    bore: bool,
    noise: float,
    outliers: float,
    rng: np.random.Generator,
) -> FittingCase:
    """A profile swept about z by `arc` (rad), with noise and outliers, in any pose and unit."""
    flat = revolved(profile, arc, columns)
    points = flat.vertices_mm
    lateral = np.abs(np.hypot(points[:, 0], points[:, 1]) - 1.0) < 1e-9
    radius_bound, axis_bound = cramer_rao(points[lateral], noise)
    moved = points + noise * rng.normal(size=points.shape)
    thrown = rng.random(len(points)) < outliers
    moved[thrown] += rng.uniform(-0.3, 0.3, size=(int(thrown.sum()), 3))
    R, shift, scale = random_rotation(rng), 10.0 * rng.normal(size=3), float(10.0 ** rng.uniform(-3.0, 3.0))
    return FittingCase(
        kind=kind,
        mesh=Mesh(vertices_mm=(moved @ R.T + shift) * scale, faces=flat.faces[:, ::-1] if bore else flat.faces),
        radius_mm=scale,
        axis=R[:, 2],
        centre_mm=(R @ np.array([0.0, 0.0, height / 2.0]) + shift) * scale,
        height_mm=height * scale,
        arc_deg=float(np.degrees(arc)),
        bore=bore,
        noise=noise,
        outliers=outliers,
        radius_bound=radius_bound,
        axis_bound_rad=axis_bound,
        profile=profile,
        columns=columns,
    )


def cramer_rao(points: FloatArray, noise: float) -> tuple[float, float]:
    """Least standard errors of radius and axis that independent noise on points of the unit cylinder about z allows."""
    u = points[:, :2] / np.linalg.norm(points[:, :2], axis=1)[:, None]
    z = points[:, 2] - points[:, 2].mean()
    J = np.stack([u[:, 0] * z, u[:, 1] * z, u[:, 0], u[:, 1], np.ones(len(z))], axis=1)
    covariance = noise**2 * np.linalg.pinv(J.T @ J)
    return float(np.sqrt(covariance[4, 4])), float(np.sqrt(covariance[0, 0] + covariance[1, 1]))


def _profile(kind: str, height: float, side: float, rows: int) -> FloatArray:
    """(radius, z) from bottom to top; `side` +1 for a boss, −1 for a bore."""
    lateral = [(1.0, z) for z in np.linspace(0.0, height, rows)]
    e = 0.1 * min(height, 1.0)
    if kind == "chamfer":
        return np.array([(1.0 - side * e, -e), *lateral, (1.0 - side * e, height + e)])
    if kind == "fillet":
        bend = [(1.0 - side * e * (1.0 - np.cos(t)), e * np.sin(t)) for t in np.linspace(0.0, np.pi / 2.0, 5)[1:]]
        return np.array([*((r, -z) for r, z in reversed(bend)), *lateral, *((r, height + z) for r, z in bend)])
    if kind == "caps":
        inner = 1.0 - 0.4 * side
        return np.array([(inner, 0.0), *lateral, (inner, height)])
    if kind == "solid":  # boss: nearly to the axis, subdivided ends; bore: a wide flange
        ends = np.linspace(0.1, 0.9, 5) if side > 0 else np.linspace(2.0, 1.1, 5)
        return np.array([*((r, 0.0) for r in ends), *lateral, *((r, height) for r in ends[::-1])])
    return np.array(lateral)
