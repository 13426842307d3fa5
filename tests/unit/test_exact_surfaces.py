"""Faces of an exact solid that continue each other on one surface count as one."""

from collections.abc import Sequence

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_NurbsConvert
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus
from OCP.collections import Array2_gp_Pnt
from OCP.Geom import Geom_BezierSurface
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

from gripwright.geometry import brep
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm

FRAME = gp_Ax2(gp_Pnt(1.0, 2.0, 3.0), gp_Dir(0, 0, 1))


def halved(shape: brep.Shape) -> brep.Shape:
    """The solid glued of its two halves on either side of the plane y = 2: faces that cross it are two."""
    halves = [brep.common(shape, brep.box((-99, low, -99), (99, high, 99))) for low, high in ((-99, 2), (2, 99))]
    return BRepAlgoAPI_Fuse(*halves).Shape()


def spline_patch(points: Sequence[Sequence[tuple[int, int, int]]]) -> brep.Shape:
    """The face of a Bézier surface."""
    poles = Array2_gp_Pnt(1, len(points), 1, len(points[0]))
    for i, row in enumerate(points):
        for j, point in enumerate(row):
            poles.SetValue(i + 1, j + 1, gp_Pnt(*point))
    return BRepBuilderAPI_MakeFace(Geom_BezierSurface(poles), 1e-6).Face()


def face_count(shape: brep.Shape) -> int:
    return len(np.unique(brep.tessellate(shape).cad_faces))


def test_a_bore_of_two_half_cylinders_and_planes_that_were_split_are_whole_again() -> None:
    block = brep.cut(brep.box((-9, -8, 0), (11, 12, 5)), [brep.cylinder_z(1.0, 2.0, 4.0, -1.0, 6.0)])
    assert len(brep.edges(halved(block))) > len(brep.edges(block))

    mesh = brep.tessellate(halved(block))

    areas_mm2 = np.bincount(mesh.cad_faces, weights=face_areas_mm2(mesh))
    ends = 400.0 - 16.0 * np.pi
    np.testing.assert_allclose(np.sort(areas_mm2), [100.0, 100.0, 100.0, 100.0, 40.0 * np.pi, ends, ends], rtol=5e-3)


def test_cones_spheres_and_tori_are_whole_again() -> None:
    cone = BRepPrimAPI_MakeCone(FRAME, 8.0, 4.0, 10.0).Shape()
    torus = BRepPrimAPI_MakeTorus(FRAME, 9.0, 3.0).Shape()
    sphere = BRepPrimAPI_MakeSphere(FRAME, 7.0).Shape()

    assert [face_count(halved(shape)) for shape in (cone, torus, sphere)] == [3, 1, 1]


def test_a_cylinder_that_is_written_as_splines_is_one_face() -> None:
    splines = BRepBuilderAPI_NurbsConvert(halved(brep.cylinder_z(1.0, 2.0, 4.0, 0.0, 9.0))).Shape()

    assert face_count(splines) == 3


def test_a_spline_that_open_cascade_cannot_examine_is_a_face_of_its_own() -> None:
    rows = [(9, 4, 0), (0, -4, 0), (-8, -9, -8)], [(7, 9, 5), (5, -1, 9), (2, 7, 5)], [(-1, 0, -6), (4, 1, 3), (-5, -9, -6)]
    with_a_pole = [[(9, 5, 5)] * 3, *rows]

    assert face_count(spline_patch(with_a_pole)) == 1


def test_surfaces_that_only_touch_are_told_apart() -> None:
    rounded = brep.fuse(brep.cylinder_z(0.0, 0.0, 5.0, 0.0, 9.0), brep.box((0, -5, 0), (20, 5, 9)))
    stepped = brep.fuse(brep.cylinder_z(0.0, 0.0, 5.0, 0.0, 9.0), brep.cylinder_z(0.0, 0.0, 5.0005, 9.0, 20.0))

    assert face_count(rounded) == 6  # two ends, half a cylinder, two sides tangent to it, one across
    assert face_count(stepped) == 5


def test_planes_in_line_that_do_not_meet_are_faces_of_their_own() -> None:
    comb = brep.cut(brep.box((0, 0, 0), (30, 10, 10)), [brep.box((10, -1, 5), (20, 11, 11))])

    mesh = brep.tessellate(comb)

    assert mesh.cad_faces is not None
    tops = set(mesh.cad_faces[face_centres_mm(mesh)[:, 2] > 10.0 - 1e-9].tolist())
    assert len(tops) == 2
