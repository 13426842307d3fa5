"""STEP through Open CASCADE: tessellation, and an assembly's names and poses. Runs in the child process alone."""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.collections import (
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher,
    Sequence_TCollection_AsciiString,
    Sequence_TDF_Label,
)
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_AsciiString, TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_Tool
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from gripwright.cad.limits import Limits
from gripwright.cad.placed import Placements
from gripwright.cad.step_whole import check_entities, check_faces
from gripwright.domain.errors import InvalidGeometry, LimitExceeded
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.brep import tessellate
from gripwright.geometry.codec import MM_PER_UNIT
from gripwright.geometry.frames import is_rigid

ANGULAR_DEFLECTION_RAD = 0.1
_UNIT_NAMES = {"millimetre": "mm", "centimetre": "cm", "metre": "m", "inch": "in", "foot": "ft", "micrometre": "micron"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepInstance:
    """A component of a STEP assembly: where it hangs in the structure and where it stands."""

    path: tuple[str, ...]  # names of the instances below the root, outermost first
    product: str
    X_PC: FloatArray  # (4, 4), P is the root's frame
    mesh: int  # index into the assembly's meshes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepAssembly:
    """The structure of a STEP file, each distinct part's mesh once."""

    name: str
    instances: tuple[StepInstance, ...]
    meshes: tuple[Mesh, ...]


def read_step_mesh(data: bytes, units: str | None, limits: Limits) -> Mesh:
    """All solids of a STEP file in its own frame as one mesh, mm. `units`, where given, must not contradict the file."""
    document = _Document(data)
    if units is not None and document.units and all(MM_PER_UNIT[unit] != MM_PER_UNIT[units] for unit in document.units):
        raise InvalidGeometry(f"states its lengths in {' and '.join(sorted(document.units))}, but units says {units}")
    meshes: dict[str, Mesh] = {}
    placed = []
    for _, part, X in document.leaves(limits):
        entry = _entry(part)
        if entry not in meshes:
            meshes[entry] = _tessellated(part)
        placed.append((X, meshes[entry]))
    triangles = sum(len(mesh.faces) for _, mesh in placed)
    if triangles > limits.max_triangles:
        raise LimitExceeded(f"holds {triangles} triangles, at most {limits.max_triangles}")
    return _joined(placed)


def read_step_assembly(data: bytes, limits: Limits) -> StepAssembly:
    """The components of a STEP file, mm; a part used several times is tessellated once."""
    document = _Document(data)
    numbers: dict[str, int] = {}
    meshes: list[Mesh] = []
    instances = []
    for path, part, X in document.leaves(limits):
        entry = _entry(part)
        if entry not in numbers:
            numbers[entry] = len(meshes)
            meshes.append(_tessellated(part))
        product = _name(part)
        instances.append(StepInstance(path=path or (product,), product=product, X_PC=X, mesh=numbers[entry]))
    return StepAssembly(name=document.name, instances=tuple(instances), meshes=tuple(meshes))


class _Document:
    """A STEP file as Open CASCADE's document of labels; lengths are in mm there."""

    def __init__(self, data: bytes) -> None:
        reader = STEPCAFControl_Reader()
        reader.SetNameMode(True)
        if reader.ReadStream("input", io.BytesIO(data)) != IFSelect_ReturnStatus.IFSelect_RetDone:
            raise InvalidGeometry("cannot be read as STEP")
        check_entities(reader)
        self._document = TDocStd_Document(TCollection_ExtendedString("XCAF"))  # owns the labels
        if not reader.Transfer(self._document):
            raise InvalidGeometry("holds no shape that can be read from STEP")
        tool = XCAFDoc_DocumentTool.ShapeTool_s(self._document.Main())
        free = Sequence_TDF_Label()
        tool.GetFreeShapes(free)
        self._roots = list(_labels(free))
        if not self._roots:
            raise InvalidGeometry("holds no shape: it may only refer to other files")
        self.units = _length_units(reader)
        self.name = _name(self._roots[0])
        check_faces(reader, _count_faces(tool))

    def leaves(self, limits: Limits) -> Iterator[tuple[tuple[str, ...], Any, FloatArray]]:
        """Instance path, label and pose of each part, in the file's order."""
        placements = Placements(limits)
        for root in self._roots:
            base = () if len(self._roots) == 1 else (_name(root),)
            yield from _leaves(root, base, _pose(XCAFDoc_ShapeTool.GetLocation_s(root)), placements)


def _leaves(
    label: Any, path: tuple[str, ...], X: FloatArray, placements: Placements
) -> Iterator[tuple[tuple[str, ...], Any, FloatArray]]:
    placements.visit(len(path) + 1)
    if not XCAFDoc_ShapeTool.IsAssembly_s(label):
        yield path, label, X
        return
    components = Sequence_TDF_Label()
    XCAFDoc_ShapeTool.GetComponents_s(label, components)
    for component in _labels(components):
        part = TDF_Label()
        XCAFDoc_ShapeTool.GetReferredShape_s(component, part)
        name = _name(component) or _name(part)
        yield from _leaves(part, (*path, name), X @ _pose(XCAFDoc_ShapeTool.GetLocation_s(component)), placements)


def _count_faces(tool: Any) -> int:
    """Faces of all parts, those of a part once however often it is used."""
    labels, count = Sequence_TDF_Label(), 0
    tool.GetShapes(labels)
    for label in _labels(labels):
        if XCAFDoc_ShapeTool.IsSimpleShape_s(label):
            faces = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
            TopExp.MapShapes_s(XCAFDoc_ShapeTool.GetShape_s(label), TopAbs_ShapeEnum.TopAbs_FACE, faces)
            count += faces.Extent()
    return count


def _labels(sequence: Any) -> Iterator[Any]:
    return (sequence.Value(k) for k in range(1, sequence.Length() + 1))


def _name(label: Any) -> str:
    attribute = TDataStd_Name()
    return str(attribute.Get().ToExtString()) if label.FindAttribute(TDataStd_Name.GetID_s(), attribute) else ""


def _entry(label: Any) -> str:
    text = TCollection_AsciiString()
    TDF_Tool.Entry_s(label, text)
    return str(text.ToCString())


def _length_units(reader: Any) -> frozenset[str]:
    lengths, angles, solid_angles = (Sequence_TCollection_AsciiString() for _ in range(3))
    reader.ChangeReader().FileUnits(lengths, angles, solid_angles)
    names = {str(text.ToCString()).lower() for text in _labels(lengths)} - {""}
    if not names:  # Open CASCADE would take them for millimetres
        raise InvalidGeometry("states no unit of length")
    return frozenset(_UNIT_NAMES[name] for name in names if name in _UNIT_NAMES)


def _pose(location: Any) -> FloatArray:
    transformation = location.Transformation()
    X = np.eye(4)
    X[:3] = [[transformation.Value(row, column) for column in range(1, 5)] for row in range(1, 4)]
    if not is_rigid(X):
        raise InvalidGeometry("places a component by a transformation that is not rigid (scaled or mirrored)")
    return X


def _tessellated(part: Any) -> Mesh:
    """A part's triangles, mm: chord error 1/1000 of the diagonal, within 0.01 and 0.1 mm; 0.1 rad a facet."""
    shape = XCAFDoc_ShapeTool.GetShape_s(part)
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box)
    if box.IsVoid() or not TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE).More():
        raise InvalidGeometry(f"holds a part without any surface ({_name(part)!r})")
    diagonal_mm = float(np.sqrt(box.SquareExtent()))
    return tessellate(shape, float(np.clip(diagonal_mm * 1e-3, 0.01, 0.1)), ANGULAR_DEFLECTION_RAD)


def _joined(parts: list[tuple[FloatArray, Mesh]]) -> Mesh:
    offsets = np.cumsum([0, *(len(mesh.vertices_mm) for _, mesh in parts)])
    numbers = [mesh.cad_faces for _, mesh in parts if mesh.cad_faces is not None]
    firsts = np.cumsum([0, *(int(faces.max(initial=-1)) + 1 for faces in numbers)])
    return Mesh(
        vertices_mm=np.concatenate([mesh.vertices_mm @ X[:3, :3].T + X[:3, 3] for X, mesh in parts]),
        faces=np.concatenate([mesh.faces + offset for (_, mesh), offset in zip(parts, offsets, strict=False)]),
        cad_faces=np.concatenate([faces + first for faces, first in zip(numbers, firsts, strict=False)]),
    )
