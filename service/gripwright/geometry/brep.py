"""Exact solids (OCP shapes) in memory: making, storing, measuring and tessellating them. Lengths in mm, no files.

Stored form: OCP's binary BRep stream without triangulation; a solid built by the same steps gives the same bytes.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from OCP.BinTools import BinTools, BinTools_FormatVersion
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.Standard import Standard_Failure
from OCP.Storage import Storage_StreamReadError
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Shape

from gripwright.domain.errors import InvalidGeometry
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.adjacency import face_adjacency
from gripwright.geometry.exact_surfaces import continued_faces

Shape = Any
"""An OCP `TopoDS_Shape`; the bindings carry no types."""

_WELD_MM = 1e-6
_BREP_HEADER = b"\nOpen CASCADE Topology V"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidMeasure:
    """Exact volume and centre of mass of a solid, uniform density."""

    volume_mm3: float
    centre_of_mass_mm: FloatArray  # (3,)


class Bore(NamedTuple):
    """A bore parallel to z."""

    x_mm: float
    y_mm: float
    diameter_mm: float
    z_min_mm: float
    z_max_mm: float


def write_brep(shape: Shape) -> bytes:
    """The shape as a binary BRep stream, without triangulation."""
    buffer = io.BytesIO()
    BinTools.Write_s(shape, buffer, False, False, BinTools_FormatVersion.BinTools_FormatVersion_CURRENT)
    return buffer.getvalue()


def read_brep(brep: bytes) -> Shape:
    """The shape of a binary BRep stream; InvalidGeometry where the bytes are none."""
    if not brep.startswith(_BREP_HEADER):  # OCP itself would print to stdout
        raise InvalidGeometry("bytes are not a binary BRep stream")
    shape = TopoDS_Shape()
    try:
        BinTools.Read_s(shape, io.BytesIO(brep))
    except (Standard_Failure, Storage_StreamReadError) as error:
        raise InvalidGeometry("the binary BRep stream is damaged") from error
    if shape.IsNull():
        raise InvalidGeometry("the BRep stream holds no shape")
    return shape


def single_solid(shape: Shape) -> Shape:
    """The one valid solid of a shape; InvalidGeometry where there is none, several, or OCP's checker objects."""
    solids = _parts(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    if len(solids) != 1:
        raise InvalidGeometry(f"the shape has {len(solids)} solids, exactly 1 is needed")
    if not BRepCheck_Analyzer(solids[0]).IsValid():
        raise InvalidGeometry("OCP's checker finds the solid invalid")
    return solids[0]


def measure(shape: Shape) -> SolidMeasure:
    """Exact volume and centre of mass."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    centre = properties.CentreOfMass()
    return SolidMeasure(volume_mm3=properties.Mass(), centre_of_mass_mm=np.array([centre.X(), centre.Y(), centre.Z()]))


def bounds_mm(shape: Shape) -> FloatArray:
    """Smallest and largest corner of the axis-aligned box that holds the exact shape, (2, 3)."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    low, high = box.CornerMin(), box.CornerMax()
    return np.array([[low.X(), low.Y(), low.Z()], [high.X(), high.Y(), high.Z()]])


def tessellate(shape: Shape, deviation_mm: float = 0.02, angle_rad: float = 0.25) -> Mesh:
    """The closed outer surface as triangles, at most `deviation_mm` away from it; the shape itself stays without triangles.

    `cad_faces` numbers the shape's faces; those that continue each other on one surface have one number.
    """
    copy = BRepBuilderAPI_Copy(shape, True, False).Shape()
    BRepMesh_IncrementalMesh(copy, deviation_mm, False, angle_rad, False)
    points: list[FloatArray] = []
    triangles: list[FloatArray] = []
    sizes: list[int] = []
    count = 0
    parts = _parts(copy, TopAbs_ShapeEnum.TopAbs_FACE)
    for part in parts:
        face_points, face_triangles = _face_triangles(part)
        points.append(face_points)
        triangles.append(face_triangles + count)
        sizes.append(len(face_triangles))
        count += len(face_points)
    vertices = np.concatenate(points)  # (n, 3)
    faces = np.concatenate(triangles).astype(np.int64)  # (m, 3)
    _, first, inverse = np.unique(np.round(vertices / _WELD_MM), axis=0, return_index=True, return_inverse=True)
    faces = inverse.reshape(-1)[faces]
    distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)  # (m,)
    mesh = Mesh(vertices_mm=vertices[first], faces=faces[distinct])
    part_of_face = np.repeat(np.arange(len(parts)), sizes)[distinct]  # (m,)
    neighbours = np.unique(part_of_face[face_adjacency(mesh).pairs], axis=0)  # (e, 2)
    return replace(mesh, cad_faces=continued_faces(parts, neighbours)[part_of_face])


def _face_triangles(face: Shape) -> tuple[FloatArray, FloatArray]:
    """Points (n, 3) and outward triangles (m, 3) of one tessellated face."""
    location = TopLoc_Location()
    triangulation = BRep_Tool.Triangulation_s(TopoDS.Face(face), location)
    if triangulation is None:
        raise InvalidGeometry("a face of the solid cannot be tessellated")
    transform = location.Transformation()
    nodes = (triangulation.Node(i).Transformed(transform) for i in range(1, triangulation.NbNodes() + 1))
    points = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
    triangles = np.array([triangulation.Triangle(i).Get() for i in range(1, triangulation.NbTriangles() + 1)]) - 1
    return points, triangles[:, ::-1] if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else triangles


def box(low_mm: Sequence[float], high_mm: Sequence[float]) -> Shape:
    """The axis-aligned box between two corners."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*map(float, low_mm)), gp_Pnt(*map(float, high_mm))).Shape()


def cylinder_z(x_mm: float, y_mm: float, radius_mm: float, z_min_mm: float, z_max_mm: float) -> Shape:
    """A cylinder about an axis parallel to z."""
    frame = gp_Ax2(gp_Pnt(x_mm, y_mm, z_min_mm), gp_Dir(0, 0, 1))
    return BRepPrimAPI_MakeCylinder(frame, radius_mm, z_max_mm - z_min_mm).Shape()


def cone_z(x_mm: float, y_mm: float, radii_mm: Sequence[float], z_min_mm: float, z_max_mm: float) -> Shape:
    """A truncated cone about an axis parallel to z, with its two radii from below to above."""
    frame = gp_Ax2(gp_Pnt(x_mm, y_mm, z_min_mm), gp_Dir(0, 0, 1))
    return BRepPrimAPI_MakeCone(frame, float(radii_mm[0]), float(radii_mm[1]), z_max_mm - z_min_mm).Shape()


def prism_z(polygon_mm: FloatArray, z_min_mm: float, z_max_mm: float) -> Shape:
    """A plane polygon (n, 2), any winding, extruded along z."""
    return prism_along(polygon_mm, z_min_mm, (0.0, 0.0, z_max_mm - z_min_mm))


def prism_along(polygon_mm: FloatArray, z_mm: float, way_mm: Sequence[float]) -> Shape:
    """A plane polygon (n, 2) at a height z, any winding, extruded along a way that may be oblique, (3,)."""
    outline = BRepBuilderAPI_MakePolygon()
    for x, y in polygon_mm:
        outline.Add(gp_Pnt(float(x), float(y), z_mm))
    outline.Close()
    face = BRepBuilderAPI_MakeFace(outline.Wire(), True).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(*map(float, way_mm))).Shape()


def prism_y(polygon_mm: FloatArray, y_min_mm: float, y_max_mm: float) -> Shape:
    """A plane polygon (n, 2) of x and z, any winding, extruded along y."""
    outline = BRepBuilderAPI_MakePolygon()
    for x, z in polygon_mm:
        outline.Add(gp_Pnt(float(x), y_min_mm, float(z)))
    outline.Close()
    face = BRepBuilderAPI_MakeFace(outline.Wire(), True).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, y_max_mm - y_min_mm, 0)).Shape()


def fuse(first: Shape, second: Shape) -> Shape:
    """The union, its coplanar neighbours merged into one face."""
    return _unified(BRepAlgoAPI_Fuse(first, second).Shape())


def cut(shape: Shape, tools: Sequence[Shape]) -> Shape:
    """The shape without the tools."""
    for tool in tools:
        shape = BRepAlgoAPI_Cut(shape, tool).Shape()
    return _unified(shape)


def common(first: Shape, second: Shape) -> Shape:
    """What both shapes share."""
    return _unified(BRepAlgoAPI_Common(first, second).Shape())


def together(shapes: Sequence[Shape]) -> Shape:
    """Several shapes as one compound, each as it is."""
    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


def chamfer(shape: Shape, width_mm: float, low_mm: FloatArray, high_mm: FloatArray) -> Shape:
    """Chamfer, by the same width on both faces, every edge that lies wholly in the closed box low..high."""
    maker = BRepFilletAPI_MakeChamfer(shape)
    seen: list[Shape] = []
    for edge in edges(shape):
        corners = bounds_mm(edge)
        inside = bool((corners[0] >= low_mm - 1e-6).all() and (corners[1] <= high_mm + 1e-6).all())
        if inside and not any(edge.IsSame(other) for other in seen):
            seen.append(edge)
            maker.Add(width_mm, edge)
    return maker.Shape() if seen else shape


def edges(shape: Shape) -> list[Shape]:
    """All edges; one that two faces share comes twice."""
    return [TopoDS.Edge(edge) for edge in _parts(shape, TopAbs_ShapeEnum.TopAbs_EDGE)]


def bores_z(shape: Shape) -> list[Bore]:
    """Every cylindrical wall about an axis parallel to z that has the axis in the open, by x, y and radius."""
    bores: set[Bore] = set()
    for face in _parts(shape, TopAbs_ShapeEnum.TopAbs_FACE):
        surface = BRepAdaptor_Surface(TopoDS.Face(face))
        if surface.GetType() != GeomAbs_SurfaceType.GeomAbs_Cylinder or face.Orientation() != TopAbs_Orientation.TopAbs_REVERSED:
            continue
        cylinder = surface.Cylinder()
        axis, low_high = cylinder.Axis(), bounds_mm(face)[:, 2]
        if abs(axis.Direction().Z()) < 1.0 - 1e-9:
            continue
        measures = (axis.Location().X(), axis.Location().Y(), 2.0 * cylinder.Radius(), *low_high)
        bores.add(Bore(*(round(float(value), 6) + 0.0 for value in measures)))
    return sorted(bores)


def _unified(shape: Shape) -> Shape:
    merger = ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    merger.Build()
    return merger.Shape()


def _parts(shape: Shape, kind: Any) -> list[Shape]:
    explorer = TopExp_Explorer(shape, kind)
    parts: list[Shape] = []
    while explorer.More():
        parts.append(explorer.Current())
        explorer.Next()
    return parts
