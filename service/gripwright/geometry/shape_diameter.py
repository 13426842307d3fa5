"""Shape diameter function (Shapira, Shamir and Cohen-Or, 2008): how thick a solid is behind each face of its surface."""

from collections.abc import Callable

import numba
import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh
from gripwright.geometry.adjacency import neighbour_lists
from gripwright.geometry.measures import diagonal_mm, face_areas_mm2, face_centres_mm, face_normals
from gripwright.geometry.rays import FloatArray32, RayScene, chunks, morton_order, thread_pool

ORIGIN_OFFSET = 1e-6
"""How far inside the surface rays begin, as a fraction of the diagonal: far enough not to hit the face itself."""
OUTLIER_LIMIT = 1.5
"""Rays farther from the median of their cone than this many median absolute deviations do not count."""
FACES_A_CHUNK = 4096
ACROSS = 0.9
"""Cosine between a normal and an axis from which the axis says too little about the tangent plane."""
PRECISION = 1e-6
"""Lengths differ from this fraction of the diagonal on, all that single precision knows of them: equal ones stay equal."""
SKEW_MIN = 1e-3
"""Least third moment about an axis, as a fraction of that of its absolute values, that says which way the axis points."""

Tangents = Callable[[Mesh, FloatArray], tuple[FloatArray, FloatArray]]
"""Two unit tangents, (k, 3) each, to turn the cone by: of a mesh at places with outward unit normals (k, 3)."""


def principal_tangents(mesh: Mesh, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tangents that turn with the mesh and change little from face to face.

    The first lies along the mesh's longest principal axis, where the surface is nearly across it along the second.
    """
    areas, centres = face_areas_mm2(mesh), face_centres_mm(mesh)
    about = np.stack([x - (areas * x).sum() / areas.sum() for x in centres.T])  # (3, m)
    _, axes = np.linalg.eigh([[(areas * x * y).sum() for x in about] for y in about])
    longest, middle = (axis * _heavier_side(axis @ about, areas) for axis in (axes[:, 2], axes[:, 1]))
    chosen = np.where(np.abs(normals @ longest)[:, None] < ACROSS, longest, middle)  # (k, 3)
    along = chosen - np.einsum("ij,ij->i", chosen, normals)[:, None] * normals
    first = along / np.linalg.norm(along, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def _heavier_side(x: FloatArray, areas: FloatArray) -> float:
    """Sign of the third moment of faces at `x` (m,); where it is too small to tell, that of the first face far out."""
    cubes = areas * x * x * x
    moment, size = cubes.sum(), np.abs(cubes).sum()
    if abs(moment) < SKEW_MIN * size:
        moment = x[np.argmax(np.abs(x) > np.abs(x).max() / 2.0)]
    return 1.0 if moment >= 0 else -1.0


def coordinate_tangents(mesh: Mesh, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """CGAL's tangents, which depend on how the mesh lies: the first is square to the coordinate axis most across the normal."""
    del mesh
    inward = -normals
    order = np.argsort(np.abs(inward), axis=1, kind="stable")  # (k, 3)
    rows, middle, last = np.arange(len(inward)), order[:, 1:].min(axis=1), order[:, 1:].max(axis=1)
    first = np.zeros_like(inward)
    first[rows, middle], first[rows, last] = -inward[rows, last], inward[rows, middle]
    for axis in (2, 1, 0):  # a normal square to coordinate axes: the first of them
        first[inward[:, axis] == 0.0] = np.eye(3)[axis]
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(inward, first)


def shape_diameters_mm(
    mesh: Mesh,
    rays: int,
    cone_angle_rad: float,
    faces: IntArray | None = None,
    tangents: Tangents = principal_tangents,
) -> FloatArray:
    """Mean length of the rays into a cone about the inward normal at each face's centre, outliers left out, (m,).

    Rays count when they hit a face from inside. NaN where none does, for faces without area and for those not among
    `faces`. `cone_angle_rad` is the full angle of the cone, less than π. Few rays see different things when the cone is
    turned about the normal: `tangents` says how it lies.
    """
    scene = RayScene(mesh.vertices_mm, mesh.faces)
    normals, diagonal = face_normals(mesh), diagonal_mm(mesh)
    chosen = np.flatnonzero(normals.any(axis=1)) if faces is None else faces[normals[faces].any(axis=1)]
    centres = face_centres_mm(mesh)[chosen]
    order = morton_order(centres)
    chosen, centres, normals = chosen[order], centres[order], normals[chosen[order]]
    axes = np.stack((*tangents(mesh, normals), -normals), axis=1).astype(np.float32)  # (k, 3, 3)
    origins = scene.centred(centres - normals * ORIGIN_OFFSET * diagonal)
    pattern = cone_directions(rays, cone_angle_rad).astype(np.float32)
    values = np.full(len(mesh.faces), np.nan)

    def trace(part: slice) -> None:
        values[chosen[part]] = _trace(scene, origins[part], pattern @ axes[part])

    with thread_pool() as pool:
        list(pool.map(trace, chunks(len(chosen), FACES_A_CHUNK)))
    return np.round(values / (PRECISION * diagonal)) * (PRECISION * diagonal)


def cone_directions(rays: int, cone_angle_rad: float) -> FloatArray:
    """Unit directions in a cone about +z, (rays, 3): a sunflower on the cone's cross-section, denser about the axis.

    Ray i is at radius i / rays of the cross-section; the density stands for the weight that the method gives to the
    rays near the axis, so that all rays count alike.
    """
    i = np.arange(rays)
    turn = i * np.pi * (3.0 - np.sqrt(5.0))  # the golden angle
    radius = i / rays * np.tan(cone_angle_rad / 2.0)
    directions = np.stack((radius * np.cos(turn), radius * np.sin(turn), np.ones(rays)), axis=1)
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def filled(values: FloatArray, pairs: IntArray) -> FloatArray:
    """Values with each NaN replaced by the mean of its neighbours that have one, from near to far; 0 where none is near."""
    return np.asarray(_filled(values, *neighbour_lists(pairs, len(values))))


def _trace(scene: RayScene, origins: FloatArray32, directions: FloatArray32) -> FloatArray:
    """Mean ray length of each face: origins (k, 3), unit directions (k, rays, 3)."""
    k, rays, _ = directions.shape
    flat = np.ascontiguousarray(directions.reshape(-1, 3))
    distance, face, normal = scene.first_hits(np.repeat(origins, rays, axis=0), flat)
    leaving = (face >= 0) & (np.einsum("ij,ij->i", normal, flat) > 0)
    return _robust_mean(np.where(leaving, distance, np.nan).reshape(k, rays))


def _robust_mean(lengths: FloatArray32) -> FloatArray:
    """Mean of each row (k, rays) without outliers; NaN marks rays that do not count, and rows without any."""
    count = (~np.isnan(lengths)).sum(axis=1)
    middle = _row_medians(lengths, count)
    deviation = np.abs(lengths - middle[:, None])
    limit = OUTLIER_LIMIT * _row_medians(deviation, count)
    good = deviation <= limit[:, None] * np.float32(1 + 1e-4)
    total = np.where(good, lengths, 0.0).sum(axis=1, dtype=np.float64)
    return np.where(count > 0, total / np.maximum(good.sum(axis=1), 1), np.nan)


def _row_medians(values: FloatArray32, count: IntArray) -> FloatArray32:
    """Median of each row's numbers, NaN sorting last."""
    ordered = np.sort(values, axis=1)
    rows = np.arange(len(values))
    low, high = np.maximum(count - 1, 0) // 2, np.maximum(count, 1) // 2
    return np.asarray((ordered[rows, low] + ordered[rows, np.minimum(high, values.shape[1] - 1)]) / 2)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _filled(values: FloatArray, start: IntArray, neighbour: IntArray) -> FloatArray:
    result = values.copy()
    missing = np.flatnonzero(np.isnan(result))
    while len(missing):
        means = np.full(len(missing), np.nan)
        for i in range(len(missing)):
            total, count = 0.0, 0
            for k in range(start[missing[i]], start[missing[i] + 1]):
                if not np.isnan(result[neighbour[k]]):
                    total += result[neighbour[k]]
                    count += 1
            if count:
                means[i] = total / count
        result[missing] = means
        left = np.isnan(means)
        if left.all():
            result[missing] = 0.0
            break
        missing = missing[left]
    return result
