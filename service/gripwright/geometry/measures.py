"""Areas, normals and volumes of triangle meshes, vectorised. Lengths in mm."""

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh


def face_cross_mm2(mesh: Mesh) -> FloatArray:
    """Twice the area vector of each face, (m, 3), pointing outwards."""
    a, b, c = np.moveaxis(mesh.triangles_mm, 1, 0)  # (m, 3) each
    return np.asarray(np.cross(b - a, c - a))


def face_areas_mm2(mesh: Mesh) -> FloatArray:
    """Area of each face, (m,)."""
    return np.asarray(np.linalg.norm(face_cross_mm2(mesh), axis=1) / 2.0)


def face_normals(mesh: Mesh) -> FloatArray:
    """Outward unit normal of each face, (m, 3); zero for a face without area."""
    cross = face_cross_mm2(mesh)
    length = np.linalg.norm(cross, axis=1, keepdims=True)  # (m, 1)
    return np.asarray(np.divide(cross, length, out=np.zeros_like(cross), where=length > 0))


def face_centres_mm(mesh: Mesh) -> FloatArray:
    """Centroid of each face, (m, 3)."""
    return np.asarray(mesh.triangles_mm.mean(axis=1))


def volume_mm3(mesh: Mesh) -> float:
    """Signed volume (divergence theorem); negative when the mesh is inside out."""
    a, b, c = np.moveaxis(mesh.triangles_mm, 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def diagonal_mm(mesh: Mesh) -> float:
    """Length of the axis-aligned bounding box's diagonal."""
    return float(np.linalg.norm(np.ptp(mesh.vertices_mm, axis=0)))


def submesh(mesh: Mesh, faces: IntArray) -> Mesh:
    """The given faces with only the vertices that they use."""
    used, inverse = np.unique(mesh.faces[faces], return_inverse=True)
    return Mesh(vertices_mm=mesh.vertices_mm[used], faces=inverse.reshape(-1, 3).astype(np.int64))
