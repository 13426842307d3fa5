"""Division of long triangles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gripwright.domain.shape import Mesh
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.measures import face_areas_mm2, face_normals, volume_mm3
from gripwright.geometry.mesh_repair import repaired
from gripwright.geometry.refine import refine
from mesh_factory import STEPPED_SHAFT, box_mesh, plate_with_bosses, turned_mesh


def _edges_mm(mesh: Mesh) -> np.ndarray:
    corners = mesh.triangles_mm
    return np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)


@settings(max_examples=15, deadline=None)
@given(edge_mm=st.floats(2.0, 40.0), sections=st.integers(3, 40))
def test_no_edge_is_left_too_long_and_nothing_moves(edge_mm: float, sections: int) -> None:
    mesh = repaired(turned_mesh(STEPPED_SHAFT, sections))

    fine = refine(mesh, edge_mm)

    assert _edges_mm(fine).max() <= edge_mm
    np.testing.assert_array_equal(fine.vertices_mm[: len(mesh.vertices_mm)], mesh.vertices_mm)
    assert volume_mm3(fine) == pytest.approx(volume_mm3(mesh), rel=1e-9)
    assert face_adjacency(fine).open_edges == 0


def test_each_new_face_lies_in_its_source_face() -> None:
    mesh = repaired(plate_with_bosses(24))

    fine = refine(mesh, 5.0)

    assert mesh.source_faces is not None
    assert fine.source_faces is not None
    assert (np.diff(fine.source_faces) >= 0).all()
    rows = np.searchsorted(mesh.source_faces, fine.source_faces)
    np.testing.assert_allclose(face_normals(fine), face_normals(mesh)[rows], atol=1e-9)
    area = np.bincount(rows, weights=face_areas_mm2(fine), minlength=len(mesh.faces))
    np.testing.assert_allclose(area, face_areas_mm2(mesh), rtol=1e-9)


def test_a_mesh_that_is_fine_enough_stays_as_it_is() -> None:
    mesh = box_mesh((1, 2, 3))

    np.testing.assert_array_equal(refine(mesh, 4.0).faces, mesh.faces)
