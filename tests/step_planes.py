"""The planes of a STEP file, as a CAD program reads it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from gripwright.domain.shape import FloatArray


def plane_normals(step: Path) -> Iterator[FloatArray]:
    """The normal (3,) of each plane face, of either sense."""
    reader = STEPControl_Reader()
    reader.ReadFile(str(step))
    reader.TransferRoots()
    faces = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_FACE)
    while faces.More():
        surface = BRepAdaptor_Surface(TopoDS.Face(faces.Current()))
        if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_Plane:
            direction = surface.Plane().Axis().Direction()
            yield np.array([direction.X(), direction.Y(), direction.Z()])
        faces.Next()
