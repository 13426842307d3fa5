"""Small components made by code, with the segments that they were made of. Lengths in mm."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import manifold3d
import numpy as np

from gripwright.domain.assembly import IDENTITY, Component
from gripwright.domain.shape import BoolArray, FloatArray, IntArray, Mesh, Segment
from gripwright.geometry.frames import pose, transform
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, submesh
from gripwright.plugin_api import RunContext

_SECTIONS = 48
_HALF = np.sqrt(0.5)
TILTED: FloatArray = pose(
    np.array([_HALF, _HALF, 0.0]), np.array([-0.5, 0.5, _HALF]), np.array([0.5, -0.5, _HALF]), np.array([40.0, -25.0, 10.0])
)
"""A pose that is aligned with no axis."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """A component, and the partition of its faces by how it was made."""

    name: str
    component: Component
    segments: tuple[Segment, ...]

    @classmethod
    def of(cls, name: str, mesh: Mesh, labels: IntArray | None = None) -> "Sample":
        """A closed mesh (mm) as a sample: its faces are one segment, or those of `labels` (m,), numbers from 0."""
        numbers = np.zeros(len(mesh.faces), dtype=np.int64) if labels is None else labels
        return cls(
            name=name,
            component=Component(id=name.replace(" ", "-"), mesh=mesh, X_PC=IDENTITY),
            segments=tuple(_segment(k, mesh, np.flatnonzero(numbers == k)) for k in range(numbers.max() + 1)),
        )

    def tilted(self) -> "Sample":
        """The same component in a pose that is aligned with no axis."""
        component = self.component
        mesh = replace(component.mesh, vertices_mm=transform(TILTED, component.mesh.vertices_mm))
        return replace(self, name=f"tilted {self.name}", component=replace(component, id=f"tilted-{component.id}", mesh=mesh))

    def scaled(self, factor: float) -> "Sample":
        """The same component at another size."""
        component = self.component
        mesh = replace(component.mesh, vertices_mm=component.mesh.vertices_mm * factor)
        segments = tuple(
            replace(part, area_mm2=part.area_mm2 * factor**2, hull_volume_mm3=part.hull_volume_mm3 * factor**3)
            for part in self.segments
        )
        return Sample(name=f"{self.name}, {factor:g} times the size", component=replace(component, mesh=mesh), segments=segments)


def sample_components() -> tuple[Sample, ...]:
    """A stepped shaft, a box with a boss, a ring, a ball, a truncated cone and a hexagonal prism; along the axes and tilted."""
    upright = (_stepped_shaft(), _box_with_boss(), _ring(), _ball(), _truncated_cone(), _hexagonal_prism())
    return (*upright, *(sample.tilted() for sample in upright))


def fake_context(seed: int = 0, progress: Callable[[float, str], None] | None = None) -> RunContext:
    """A context as a plug-in gets it in a design, of any seed; `progress` hears what the plug-in reports."""
    return RunContext(seed=seed) if progress is None else RunContext(seed=seed, progress=progress)


def _stepped_shaft() -> Sample:
    """Radius 10 up to z = 20, from there radius 5 up to z = 45."""
    solid = _cylinder(20.0, 10.0) + _cylinder(30.0, 5.0).translate((0.0, 0.0, 15.0))
    return _sample("stepped shaft", solid, lambda centres: centres[:, 2] > 20.0 + 1e-6)


def _box_with_boss() -> Sample:
    """A box of 40 × 30 × 12 with a boss of radius 6 that stands 15 out of its top."""
    solid = manifold3d.Manifold.cube((40.0, 30.0, 12.0)) + _cylinder(20.0, 6.0).translate((20.0, 15.0, 7.0))
    return _sample("box with boss", solid, lambda centres: centres[:, 2] > 12.0 + 1e-6)


def _ring() -> Sample:
    """Radius 15 outside, a bore of radius 9, 10 high."""
    solid = _cylinder(10.0, 15.0) - _cylinder(20.0, 9.0).translate((0.0, 0.0, -5.0))
    return _sample("ring", solid, lambda centres: np.hypot(centres[:, 0], centres[:, 1]) < 9.0 + 1e-6)


def _ball() -> Sample:
    """Radius 12."""
    return _sample("ball", manifold3d.Manifold.sphere(12.0, _SECTIONS))


def _truncated_cone() -> Sample:
    """Radius 10 at the foot, 4 at the top, 15 high."""
    return _sample("truncated cone", manifold3d.Manifold.cylinder(15.0, 10.0, 4.0, _SECTIONS))


def _hexagonal_prism() -> Sample:
    """Corners at radius 10, 14 high."""
    return _sample("hexagonal prism", manifold3d.Manifold.cylinder(14.0, 10.0, 10.0, 6))


def _cylinder(height_mm: float, radius_mm: float) -> manifold3d.Manifold:
    return manifold3d.Manifold.cylinder(height_mm, radius_mm, radius_mm, _SECTIONS)


def _sample(name: str, solid: manifold3d.Manifold, second: Callable[[FloatArray], BoolArray] | None = None) -> Sample:
    """A solid whose faces are one segment, or two; `second` tells the second one's by their centres (m, 3)."""
    found = solid.to_mesh64()
    mesh = Mesh(vertices_mm=np.array(found.vert_properties[:, :3], dtype=float), faces=np.array(found.tri_verts, dtype=np.int64))
    return Sample.of(name, mesh, None if second is None else second(face_centres_mm(mesh)).astype(np.int64))


def _segment(number: int, mesh: Mesh, faces: IntArray) -> Segment:
    part = submesh(mesh, faces)
    return Segment(
        id=number,
        faces=faces,
        area_mm2=float(face_areas_mm2(part).sum()),
        hull_volume_mm3=manifold3d.Manifold.hull_points(part.vertices_mm).volume(),
    )
