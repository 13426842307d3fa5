"""Which faces of an exact solid continue each other: many CAD systems write a bore as two half cylinders. Lengths in mm."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.GeomAdaptor import GeomAdaptor_Surface
from OCP.GeomConvert import GeomConvert_SurfToAnaSurf
from OCP.Standard import (
    Standard_ConstructionError,
    Standard_DomainError,
    Standard_Failure,
    Standard_NumericError,
    Standard_OutOfRange,
)
from OCP.StdFail import StdFail_NotDone
from OCP.TopoDS import TopoDS

from gripwright.domain.shape import FloatArray, IntArray
from gripwright.geometry.adjacency import connected_labels

SAME_MM, SAME_RAD = 1e-4, 1e-5
"""Surfaces that differ by less are one: above the digits that STEP files are rounded to, below any step that is meant."""

_PLANE, _CYLINDER = GeomAbs_SurfaceType.GeomAbs_Plane, GeomAbs_SurfaceType.GeomAbs_Cylinder

_UNSUITED = (
    Standard_ConstructionError,
    Standard_DomainError,
    Standard_Failure,
    Standard_NumericError,
    Standard_OutOfRange,
    StdFail_NotDone,
)
"""What Open CASCADE raises over a surface that it cannot examine; in Python these have no base class in common."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Surface:
    """A whole plane, cylinder, cone, sphere or torus."""

    kind: Any  # GeomAbs_SurfaceType
    point_mm: FloatArray  # (3,) any of the plane or the cylinder's axis, apex of the cone, centre of the others
    axis: FloatArray  # (3,) unit, normal of the plane, none (zero) of the sphere
    radii_mm: tuple[float, ...] = ()
    angle_rad: float = 0.0  # of the cone

    def is_same(self, other: "_Surface") -> bool:
        """Whether both are one surface, within the tolerances."""
        if self.kind != other.kind or abs(self.angle_rad - other.angle_rad) > SAME_RAD:
            return False
        apart = other.point_mm - self.point_mm
        along = self.axis * float(apart @ self.axis)
        offset = along if self.kind == _PLANE else apart - along if self.kind == _CYLINDER else apart
        return bool(
            np.linalg.norm(np.cross(self.axis, other.axis)) <= SAME_RAD
            and np.linalg.norm(offset) <= SAME_MM
            and np.abs(np.subtract(self.radii_mm, other.radii_mm)).max(initial=0.0) <= SAME_MM
        )


def continued_faces(faces: Sequence[Any], neighbours: IntArray) -> IntArray:
    """Number of the surface that each face (an OCP shape) is part of, (len(faces),).

    Faces share a number where they lie on one plane, cylinder, cone, sphere or torus and are `neighbours`, (e, 2) positions.
    """
    surfaces = [_surface_of(face) for face in faces]
    same = [_are_same(surfaces[a], surfaces[b]) for a, b in neighbours.tolist()]
    return connected_labels(neighbours[np.array(same, dtype=bool)], len(faces))


def _are_same(first: _Surface | None, second: _Surface | None) -> bool:
    return first is not None and second is not None and first.is_same(second)


def _surface_of(face: Any) -> _Surface | None:
    """The surface of a face; None where it is of another kind."""
    adaptor = GeomAdaptor_Surface(_recognised(BRep_Tool.Surface_s(TopoDS.Face(face))))
    kind = adaptor.GetType()
    match kind:
        case GeomAbs_SurfaceType.GeomAbs_Plane:
            plane = adaptor.Plane()
            return _Surface(kind=kind, point_mm=_vector(plane.Location()), axis=_vector(plane.Axis().Direction()))
        case GeomAbs_SurfaceType.GeomAbs_Cylinder:
            cylinder = adaptor.Cylinder()
            point, axis = _vector(cylinder.Location()), _vector(cylinder.Axis().Direction())
            return _Surface(kind=kind, point_mm=point, axis=axis, radii_mm=(cylinder.Radius(),))
        case GeomAbs_SurfaceType.GeomAbs_Cone:
            cone = adaptor.Cone()
            point, axis = _vector(cone.Apex()), _vector(cone.Axis().Direction())
            return _Surface(kind=kind, point_mm=point, axis=axis, angle_rad=abs(cone.SemiAngle()))
        case GeomAbs_SurfaceType.GeomAbs_Sphere:
            sphere = adaptor.Sphere()
            return _Surface(kind=kind, point_mm=_vector(sphere.Location()), axis=np.zeros(3), radii_mm=(sphere.Radius(),))
        case GeomAbs_SurfaceType.GeomAbs_Torus:
            torus = adaptor.Torus()
            point, axis = _vector(torus.Location()), _vector(torus.Axis().Direction())
            return _Surface(kind=kind, point_mm=point, axis=axis, radii_mm=(torus.MajorRadius(), torus.MinorRadius()))
    return None


def _recognised(surface: Any) -> Any:
    """A Geom_Surface as the plane, cylinder, … that it is: some CAD systems write all surfaces as splines."""
    try:
        return GeomConvert_SurfToAnaSurf(surface).ConvertToAnalytical(SAME_MM) or surface
    except _UNSUITED:  # a degenerate spline, such as one with a pole, is none of them
        return surface


def _vector(point: Any) -> FloatArray:
    """A gp_Pnt or gp_Dir, (3,)."""
    return np.array([point.X(), point.Y(), point.Z()])
