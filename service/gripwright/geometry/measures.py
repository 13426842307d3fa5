"""Areas, normals and volumes of triangle meshes, vectorised. Lengths in mm."""

import numpy as np

from gripwright.domain.shape import FloatArray, IntArray, Mesh


def face_cross_mm2(mesh: Mesh) -> FloatArray:
    """Twice the area vector of each face, (m, 3), pointing outwards."""
    a, b, c = mesh.faces.T
    origin = mesh.vertices_mm[a]
    (bx, by, bz), (cx, cy, cz) = (mesh.vertices_mm[b] - origin).T, (mesh.vertices_mm[c] - origin).T
    return np.stack((by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx), axis=1)


def face_areas_mm2(mesh: Mesh) -> FloatArray:
    """Area of each face, (m,)."""
    x, y, z = face_cross_mm2(mesh).T
    return np.asarray(np.sqrt(x * x + y * y + z * z) / 2.0)


def face_normals(mesh: Mesh) -> FloatArray:
    """Outward unit normal of each face, (m, 3); zero for a face without area."""
    cross = face_cross_mm2(mesh)
    length = np.linalg.norm(cross, axis=1, keepdims=True)  # (m, 1)
    return np.asarray(np.divide(cross, length, out=np.zeros_like(cross), where=length > 0))


def face_centres_mm(mesh: Mesh) -> FloatArray:
    """Centroid of each face, (m, 3)."""
    a, b, c = mesh.faces.T
    return np.asarray((mesh.vertices_mm[a] + mesh.vertices_mm[b] + mesh.vertices_mm[c]) / 3.0)


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
