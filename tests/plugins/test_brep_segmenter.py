"""Segmentation by the faces of a STEP file: the features of the solid, whatever it was tessellated to."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from gripwright.cad.export import step_bytes
from gripwright.cad.read import read_mesh
from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import Box, IntArray, Mesh, Segment
from gripwright.geometry import brep
from gripwright.geometry.frames import transform
from gripwright.geometry.measures import face_centres_mm
from gripwright.plugin_api import RunContext
from gripwright.testing.samples import TILTED
from gripwright_builtin.fitters.box import BoxFitter
from gripwright_builtin.segmenters.brep import BrepSegmenter
from mesh_factory import box_mesh, component_of


def stepped_shaft() -> brep.Shape:
    """Radius 10 up to z = 20, 5 up to 45, 8 up to 50, with a bore of radius 2 through all of it."""
    steps = [brep.cylinder_z(0, 0, 10, 0, 20), brep.cylinder_z(0, 0, 5, 20, 45), brep.cylinder_z(0, 0, 8, 45, 50)]
    return brep.cut(brep.fuse(brep.fuse(steps[0], steps[1]), steps[2]), [brep.cylinder_z(0, 0, 2, -1, 51)])


def plate_with_boss() -> brep.Shape:
    """A chamfered plate with a boss and a bore."""
    plate = brep.box((0, 0, 0), (60, 40, 8))
    chamfered = brep.chamfer(plate, 1.0, np.array([-1.0, -1.0, 7.9]), np.array([61.0, 41.0, 8.1]))
    return brep.cut(brep.fuse(chamfered, brep.cylinder_z(15, 20, 7, 4, 30)), [brep.cylinder_z(40, 20, 9, -1, 9)])


def prepared(mesh: Mesh) -> Mesh:
    return prepare(mesh, PrepareSettings(), RunContext()).mesh


def step_mesh(shape: brep.Shape) -> Mesh:
    return prepared(read_mesh(step_bytes(brep.write_brep(shape), name="part", part_number="P-1"), "step", None))


def segments_of(mesh: Mesh) -> Sequence[Segment]:
    answer = BrepSegmenter(BrepSegmenter.Settings()).segment(component_of(mesh), RunContext())
    assert not isinstance(answer, Rejection)
    return answer


def segment_of_cad_face(mesh: Mesh) -> IntArray:
    """Segment of each face of the CAD model, which must lie in one; numbered in the order of those faces."""
    labels = np.empty(len(mesh.faces), dtype=np.int64)
    for segment in segments_of(mesh):
        labels[segment.faces] = segment.id
    pairs = np.unique(np.stack((mesh.cad_faces, labels), axis=1), axis=0)
    assert len(pairs) == len(np.unique(pairs[:, 0]))
    _, first, inverse = np.unique(pairs[:, 1], return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[inverse]


def test_a_box_is_one_segment_whose_box_is_the_box_itself() -> None:
    mesh = step_mesh(brep.box((5, 6, 7), (35, 26, 17)))

    (segment,) = segments_of(mesh)

    fit = BoxFitter(BoxFitter.params_model()).fit(component_of(mesh), segment, RunContext())
    assert isinstance(fit, Box)
    assert np.sort(fit.extents_mm) == pytest.approx([10.0, 20.0, 30.0], abs=1e-6)
    assert fit.X_CB[:3, 3] == pytest.approx([20.0, 16.0, 12.0], abs=1e-6)


def test_the_steps_of_a_shaft_and_its_bore_are_the_segments() -> None:
    mesh = step_mesh(stepped_shaft())

    segments = segments_of(mesh)

    centres = face_centres_mm(mesh)
    radius = np.linalg.norm(centres[:, :2], axis=1)
    feature = np.where(radius < 2.001, 3, np.searchsorted([20.001, 44.999], centres[:, 2]))  # of each face
    assert len(segments) == 4
    assert sorted(np.unique(feature[segment.faces]).tolist() for segment in segments) == [[0], [1], [2], [3]]


@pytest.mark.parametrize("shape", [stepped_shaft(), plate_with_boss()], ids=["shaft", "plate"])
def test_coarse_and_fine_tessellations_have_the_same_segments(shape: brep.Shape) -> None:
    coarse, fine = (prepared(brep.tessellate(shape, *deflection)) for deflection in ((0.3, 0.5), (0.01, 0.06)))

    partition = segment_of_cad_face(coarse)

    assert len(fine.faces) != len(coarse.faces)
    assert partition.max() > 0
    assert np.array_equal(partition, segment_of_cad_face(fine))


def test_neither_the_pose_nor_the_order_of_the_triangles_changes_the_segments() -> None:
    mesh = prepared(brep.tessellate(plate_with_boss()))
    order = np.random.default_rng(3).permutation(len(mesh.faces))

    other = replace(
        mesh, vertices_mm=transform(TILTED, mesh.vertices_mm), faces=mesh.faces[order], cad_faces=mesh.cad_faces[order]
    )

    assert np.array_equal(segment_of_cad_face(other), segment_of_cad_face(mesh))


def test_a_mesh_without_cad_faces_is_rejected_with_what_to_do() -> None:
    answer = BrepSegmenter(BrepSegmenter.Settings()).segment(component_of(box_mesh((1.0, 2.0, 3.0))), RunContext())

    assert isinstance(answer, Rejection)
    assert "segmenter=sdf" in answer.detail
