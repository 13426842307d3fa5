"""How high the contact of a finger with a component is: small gap and nearly parallel surfaces, no edge."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.ndimage import binary_closing, label

from checker.shapes import Array

GAP_MAX_MM = 0.05
OVERLAP_MAX_MM = 0.01
PARALLEL_COS = float(np.cos(np.radians(5.0)))
PITCH_MM = 0.1
NEIGHBOURS = np.ones((3, 3), dtype=bool)
GROWTH_MM = np.array([[-GAP_MAX_MM], [GAP_MAX_MM]])  # of a box, (2, 1)


def contact_height(finger: trimesh.Trimesh, component: trimesh.Trimesh, facing: float) -> float:
    """Height along z, in mm, of the highest connected contact; both in the finger frame.

    `facing` is the sign of x that gripping surfaces look at. The finger is sampled on a grid in y and z, and from each sample
    on a face that looks so, a ray along the face's normal measures the gap and meets the component's surface.
    """
    points, normals = _samples(finger, component.bounds + GROWTH_MM, facing)
    local = _cropped(component, finger.bounds + GROWTH_MM)
    if len(points) == 0 or len(local.faces) == 0:
        return 0.0
    origins = points - (OVERLAP_MAX_MM + GAP_MAX_MM) * normals
    hits = local.ray.intersects_first(origins, normals)  # (n,): face or -1
    struck = hits >= 0
    planes = local.face_normals[hits]
    cosines = -np.einsum("ij,ij->i", planes, normals)
    parallel = struck & (cosines >= PARALLEL_COS)
    ahead = np.einsum("ij,ij->i", planes, local.triangles[hits, 0] - points)
    gaps = np.full(len(points), np.inf)
    gaps[parallel] = -ahead[parallel] / cosines[parallel]
    touching = (gaps <= GAP_MAX_MM) & (gaps >= -OVERLAP_MAX_MM)
    return _highest(points[touching])


def _samples(finger: trimesh.Trimesh, box: Array, facing: float) -> tuple[Array, Array]:
    """Points and normals on faces that look along `facing`·x, inside the box, on a grid in y and z."""
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for triangle, normal in zip(finger.triangles, finger.face_normals, strict=True):
        low = np.maximum(triangle.min(axis=0), box[0])
        high = np.minimum(triangle.max(axis=0), box[1])
        if normal[0] * facing < 0.1 or (low > high).any():
            continue
        ys, zs = (PITCH_MM * (np.arange(np.floor(low[k] / PITCH_MM), np.ceil(high[k] / PITCH_MM)) + 0.437) for k in (1, 2))
        grid = np.stack(np.meshgrid(ys, zs), axis=-1).reshape(-1, 2)  # (n, 2)
        sides = np.column_stack([triangle[1, 1:] - triangle[0, 1:], triangle[2, 1:] - triangle[0, 1:]])
        weights = np.linalg.solve(sides, (grid - triangle[0, 1:]).T).T  # (n, 2): of corners 1 and 2
        weights = weights[(weights >= 0).all(axis=1) & (weights.sum(axis=1) <= 1)]
        points.append(triangle[0] + weights @ (triangle[1:] - triangle[0]))
        normals.append(np.tile(normal, (len(weights), 1)))
    return np.vstack(points), np.vstack(normals)


def _cropped(mesh: trimesh.Trimesh, box: Array) -> trimesh.Trimesh:
    corners = mesh.triangles
    meets = ((corners.max(axis=1) >= box[0]) & (corners.min(axis=1) <= box[1])).all(axis=1)
    return trimesh.Trimesh(mesh.vertices, mesh.faces[meets], process=False)


def _highest(points: Array) -> float:
    """Extent in z of the highest piece of contact, samples next to each other being one piece."""
    if len(points) == 0:
        return 0.0
    cells = np.floor(points[:, 1:] / PITCH_MM).astype(int)
    cells -= cells.min(axis=0) - 2  # a border for the closing
    grid = np.zeros(cells.max(axis=0) + 3, dtype=bool)
    grid[cells[:, 0], cells[:, 1]] = True
    pieces, count = label(binary_closing(grid, NEIGHBOURS), NEIGHBOURS)
    heights = [np.ptp(np.nonzero(pieces == piece)[1]) + 1 for piece in range(1, count + 1)]
    return PITCH_MM * float(max(heights))
