"""Meshes, segments and primitives of one component, in the component's own frame C, lengths in mm."""

from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mesh:
    """A triangle mesh. Faces wind counter-clockwise seen from outside.

    A prepared mesh is the mesh of the file with its long thin triangles divided, so that a face of it lies wholly inside
    one face of the file: `source_faces` names that face. Nothing moves by preparation; where threads were smoothed,
    `smooth_vertices_mm` holds the moved positions, for segmentation alone. Where the file is an exact model (STEP),
    `cad_faces` numbers the model's own face that each triangle comes from. Faces that continue each other on one surface
    (the halves of a bore) share a number, those of different solids never do.
    """

    vertices_mm: FloatArray  # (n, 3)
    faces: IntArray  # (m, 3) vertex indices
    source_faces: IntArray | None = None  # (m,) face of the file, None: the file's own faces
    smooth_vertices_mm: FloatArray | None = None  # (n, 3)
    cad_faces: IntArray | None = None  # (m,) from 0; None: the file has triangles alone

    @property
    def triangles_mm(self) -> FloatArray:
        """Corner points, (m, 3, 3)."""
        return self.vertices_mm[self.faces]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segment:
    """A connected set of faces of one component's prepared mesh. The segments of a component partition its faces."""

    id: int
    faces: IntArray  # (k,) indices into mesh.faces, ascending
    area_mm2: float
    hull_volume_mm3: float


@runtime_checkable
class Primitive(Protocol):
    """A simple shape fitted to a segment. Open: plug-ins bring their own classes (frozen dataclasses)."""

    @property
    def kind(self) -> str:
        """What rules dispatch on: "cylinder", "box", "cone", …"""
        ...

    @property
    def volume_mm3(self) -> float:
        """Volume of the closed primitive, compared with the segment's convex hull (paper, section 4.2)."""
        ...

    @property
    def surface_filled(self) -> bool:
        """Whether a surface that a gripper would hold has material behind it (paper, section 4.2)."""
        ...

    @property
    def rms_mm(self) -> float:
        """Root mean square distance of the segment's supporting points from the primitive's surface."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """JSON values in mm and the component's frame, without `kind`."""
        ...


@runtime_checkable
class FollowedPrimitive(Primitive, Protocol):
    """A primitive that also says which surface lies on it. Optional: without it a segment counts as a whole, by `rms_mm`."""

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """Which points (n, 3) with outward unit normals (n, 3) lie on the surface of the closed primitive, (n,)."""
        ...


@runtime_checkable
class CurvedPrimitive(Primitive, Protocol):
    """A primitive that also says how curved it is across the lines along which fingers touch it. Optional: else it is flat."""

    @property
    def contact_radius_mm(self) -> float:
        """Radius of curvature; inf where it is flat."""
        ...


@runtime_checkable
class DrawnPrimitive(Primitive, Protocol):
    """A primitive that can be shown in pictures. Optional: without it the picture leaves its segment out."""

    def drawn(self) -> Mesh:
        """Its closed surface in the component's frame, faces outwards, mm; it holds `volume_mm3` within 2 %."""
        ...


@runtime_checkable
class AxialPrimitive(Primitive, Protocol):
    """A primitive along an axis, about which centric grasps are planned. Optional."""

    @property
    def center_C(self) -> FloatArray:
        """Midpoint of the axis, (3,)."""
        ...

    @property
    def axis_C(self) -> FloatArray:
        """Direction of the axis, (3,), unit."""
        ...

    @property
    def height_mm(self) -> float:
        """Extent along the axis."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cylinder:
    """A right circular cylinder: `center_C` is the midpoint of its axis, `height_mm` its full height along `axis_C`."""

    center_C: FloatArray  # (3,)
    axis_C: FloatArray  # (3,) unit
    radius_mm: float
    height_mm: float
    internal: bool  # True: a bore, normals point to the axis
    arc_rad: float  # angle about the axis that is covered by surface, 0..2π
    rms_mm: float
    surface_filled: bool
    radius_sigma_mm: float = 0.0  # standard error of the radius
    axis_sigma_rad: float = 0.0  # standard error of the axis direction
    bore: "Cylinder | None" = None  # of an outer surface: the bore that the same segment has besides, if it is filled
    kind: str = field(default="cylinder", init=False)

    @property
    def contact_radius_mm(self) -> float:
        """See `CurvedPrimitive`."""
        return self.radius_mm

    @property
    def volume_mm3(self) -> float:
        """π r² h."""
        return float(np.pi * self.radius_mm**2 * self.height_mm)

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`; chords of `angle_rad` lie deeper, and a bore has no end faces."""
        along = (points_mm - self.center_C) @ self.axis_C  # (n,)
        radial = points_mm - self.center_C - np.outer(along, self.axis_C)  # (n, 3)
        distance, sign = np.linalg.norm(radial, axis=1), -1.0 if self.internal else 1.0
        beyond = np.abs(along) - self.height_mm / 2.0
        depth = self.radius_mm - distance  # of a chord: up to r (1 − cos)
        turned = (normals * radial).sum(axis=1) * sign >= np.cos(angle_rad) * distance
        chord_mm = self.radius_mm * (1.0 - np.cos(angle_rad))
        lateral = turned & (depth >= -tolerance_mm) & (depth <= tolerance_mm + chord_mm) & (beyond <= tolerance_mm)
        end = (np.abs(beyond) <= tolerance_mm) & (depth >= -tolerance_mm)
        end &= normals @ self.axis_C * np.sign(along) >= np.cos(angle_rad)
        return np.asarray(lateral if self.internal else lateral | end)

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm and degrees."""
        return {
            "radius": self.radius_mm,
            "height": self.height_mm,
            "axis": self.axis_C.tolist(),
            "center": self.center_C.tolist(),
            "internal": self.internal,
            "arc": float(np.degrees(self.arc_rad)),
            "rms": self.rms_mm,
            "radius_sigma": self.radius_sigma_mm,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Box:
    """An oriented bounding box, centred on frame B, its extents along B's axes.

    `filled` gives, for the faces −x, +x, −y, +y, −z, +z of B, the fraction of the face's area that is covered by surface
    of the segment lying on it (0..1).
    """

    X_CB: FloatArray  # (4, 4)
    extents_mm: FloatArray  # (3,)
    filled: FloatArray  # (6,)
    filled_min: float  # fraction from which a face counts as filled
    rms_mm: float
    kind: str = field(default="box", init=False)

    @property
    def volume_mm3(self) -> float:
        """Product of the extents."""
        return float(np.prod(self.extents_mm))

    @property
    def surface_filled(self) -> bool:
        """Whether at least one pair of opposite faces is filled."""
        return bool(((self.filled[0::2] >= self.filled_min) & (self.filled[1::2] >= self.filled_min)).any())

    def follows(self, points_mm: FloatArray, normals: FloatArray, tolerance_mm: float, angle_rad: float) -> BoolArray:
        """See `FollowedPrimitive`: the points on the six faces."""
        places = (points_mm - self.X_CB[:3, 3]) @ self.X_CB[:3, :3]  # (n, 3)
        outwards = normals @ self.X_CB[:3, :3] * np.sign(places)
        near = np.abs(np.abs(places) - self.extents_mm / 2.0) <= tolerance_mm
        return np.asarray((near & (outwards >= np.cos(angle_rad))).any(axis=1))

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm."""
        return {
            "extents": self.extents_mm.tolist(),
            "axes": self.X_CB[:3, :3].T.tolist(),
            "center": self.X_CB[:3, 3].tolist(),
            "filled": self.filled.tolist(),
            "rms": self.rms_mm,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SegmentAnalysis:
    """A segment with the primitive that was kept, or the reason why none was; `fits` says how each fitter fared."""

    segment: Segment
    primitive: Primitive | None
    fits: tuple[dict[str, Any], ...]  # JSON: fitter, kind, volume_ratio, surface_filled, kept | code, detail
    reason: str  # one sentence: why this primitive was kept or none was
    alternatives: tuple[Primitive, ...] = ()  # the other primitives with a filled surface, the next best first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Analysis:
    """What is known of one distinct mesh: prepared, segmented, fitted."""

    mesh: Mesh  # prepared
    source_labels: IntArray  # (faces of the file,) segment id
    segments: tuple[SegmentAnalysis, ...]
    segmenter: str
    warnings: tuple[str, ...]
    timings: dict[str, float]  # s, disjoint parts: prepare.*, segment.*, fit.*
    sdf: FloatArray | None = None  # (m,) shape diameter a face, mm, where the segmenter computes one
    remarks: tuple[str, ...] = ()  # sentences of the segmenter: how it came to these segments

    @property
    def face_labels(self) -> IntArray:
        """Segment id of each face of the prepared mesh, (m,)."""
        labels = np.empty(len(self.mesh.faces), dtype=np.int64)
        for item in self.segments:
            labels[item.segment.faces] = item.segment.id
        return labels
