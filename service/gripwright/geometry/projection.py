"""Views of an exact solid for drawings: edges projected along a direction, divided into visible and hidden. Lengths in mm."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepLib import BRepLib
from OCP.GCPnts import GCPnts_QuasiUniformDeflection
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.HLRAlgo import HLRAlgo_Projector
from OCP.HLRBRep import HLRBRep_Algo, HLRBRep_HLRToShape

from gripwright.domain.shape import FloatArray
from gripwright.geometry.brep import Shape, edges

_DEVIATION_MM = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Projection:
    """Polylines (k, 2) in the plane of the view, right and up, its origin that of the solid's frame."""

    visible: tuple[FloatArray, ...]
    hidden: tuple[FloatArray, ...]


def project(shape: Shape, toward_viewer: Sequence[float], right: Sequence[float]) -> Projection:
    """The solid seen from the direction `toward_viewer`; `right` is the direction that points to the right in the view."""
    frame = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(*map(float, toward_viewer)), gp_Dir(*map(float, right)))
    algorithm = HLRBRep_Algo()
    algorithm.Add(shape)
    algorithm.Projector(HLRAlgo_Projector(frame))
    algorithm.Update()
    algorithm.Hide()
    result = HLRBRep_HLRToShape(algorithm)
    return Projection(
        visible=_polylines([result.VCompound(), result.OutLineVCompound()]),
        hidden=_polylines([result.HCompound(), result.OutLineHCompound()]),
    )


def _polylines(compounds: Sequence[Shape]) -> tuple[FloatArray, ...]:
    lines: list[FloatArray] = []
    for compound in compounds:
        if compound is None or compound.IsNull():
            continue
        BRepLib.BuildCurves3d_s(compound)
        for edge in edges(compound):
            points = GCPnts_QuasiUniformDeflection(BRepAdaptor_Curve(edge), _DEVIATION_MM)
            values = (points.Value(i) for i in range(1, points.NbPoints() + 1))
            lines.append(np.array([(p.X(), p.Y()) for p in values]))
    return tuple(sorted(lines, key=lambda line: tuple(np.round(line, 6).ravel())))
