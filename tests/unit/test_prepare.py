"""Stage 1: the prepared mesh and its warnings."""

import numpy as np
import pytest

from gripwright.design.stages.prepare import PrepareSettings, edge_max_mm, prepare
from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import Mesh
from gripwright.geometry.measures import face_areas_mm2, volume_mm3
from gripwright.plugin_api import RunContext
from mesh_factory import STEPPED_SHAFT, box_mesh, plate_with_bosses, soup, sphere_mesh, turned_mesh


def test_every_face_of_the_file_has_its_area_in_the_prepared_mesh() -> None:
    file = soup(plate_with_bosses(32))
    ctx = RunContext()

    prepared = prepare(file, PrepareSettings(), ctx)

    assert prepared.warnings == ()
    assert prepared.mesh.source_faces is not None
    area = np.bincount(prepared.mesh.source_faces, weights=face_areas_mm2(prepared.mesh), minlength=len(file.faces))
    np.testing.assert_allclose(area, face_areas_mm2(file), rtol=1e-9)
    assert ctx.timings.keys() == {"prepare.repair", "prepare.refine", "prepare.smooth"}


def test_a_prepared_face_comes_from_the_cad_face_of_the_face_that_it_divides() -> None:
    box = box_mesh((30.0, 20.0, 10.0))
    faces = np.concatenate((box.faces, box.faces[:1, [0, 0, 1]]))  # preparation leaves the last one out
    file = Mesh(vertices_mm=box.vertices_mm, faces=faces, cad_faces=np.arange(13) // 2)

    mesh = prepare(file, PrepareSettings(), RunContext()).mesh

    assert len(mesh.faces) > 12
    assert mesh.cad_faces is not None
    np.testing.assert_array_equal(mesh.cad_faces, file.cad_faces[mesh.source_faces])


def test_edges_are_at_most_the_settings_fraction_of_the_extent() -> None:
    shaft = turned_mesh(STEPPED_SHAFT, 24)

    mesh = prepare(shaft, PrepareSettings(edge=0.05), RunContext()).mesh

    corners = mesh.triangles_mm
    assert np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2).max() <= 0.05 * 2.0 * np.hypot(45.0, 10.0)


def test_a_mesh_of_many_long_triangles_grows_only_so_far() -> None:
    shaft = turned_mesh(STEPPED_SHAFT, 3000)
    settings = PrepareSettings(growth=1.5, faces=100)

    mesh = prepare(shaft, settings, RunContext()).mesh

    assert edge_max_mm(shaft, settings) > edge_max_mm(shaft, PrepareSettings(growth=100.0))
    assert len(mesh.faces) < 3 * len(shaft.faces)


def test_what_was_mended_or_stays_wrong_is_a_warning_with_its_count() -> None:
    sphere = sphere_mesh(5.0, 64)
    faces = sphere.faces.copy()
    faces[:7] = faces[:7, ::-1]
    faces[7] = faces[7, [0, 0, 1]]

    prepared = prepare(Mesh(vertices_mm=sphere.vertices_mm, faces=faces), PrepareSettings(), RunContext())

    assert [w for w in prepared.warnings if "left out: 1" in w]
    assert [w for w in prepared.warnings if "turned round: 7" in w]
    assert [w for w in prepared.warnings if "open: 3 edges" in w]


def test_an_inside_out_mesh_is_turned() -> None:
    shaft = turned_mesh(STEPPED_SHAFT, 24)

    prepared = prepare(Mesh(vertices_mm=shaft.vertices_mm, faces=shaft.faces[:, ::-1]), PrepareSettings(), RunContext())

    assert volume_mm3(prepared.mesh) == pytest.approx(volume_mm3(shaft))
    assert prepared.warnings


def test_half_a_surface_is_refused() -> None:
    sphere = sphere_mesh(5.0, 64)
    upper = sphere.triangles_mm[:, :, 2].mean(axis=1) > 0

    with pytest.raises(InvalidGeometry, match="mostly open"):
        prepare(Mesh(vertices_mm=sphere.vertices_mm, faces=sphere.faces[upper]), PrepareSettings(), RunContext())
