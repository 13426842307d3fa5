"""A sphere fitted to a segment by an outside library, which knows nothing of Gripwright."""

import random
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pydantic import Field
from pyransac3d import Sphere

from gripwright.domain.assembly import Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import FloatArray, Primitive, Segment
from gripwright.geometry.measures import face_centres_mm, face_normals
from gripwright.plugin_api import Params, RunContext

_TOLD_EVERY = 25  # samples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RansacSphere:
    """A solid sphere in the component's frame."""

    center_C: FloatArray  # (3,)
    radius_mm: float
    rms_mm: float
    surface_filled: bool
    kind: str = field(default="ransac_sphere", init=False)

    @property
    def volume_mm3(self) -> float:
        """4/3 π r³."""
        return 4.0 / 3.0 * float(np.pi) * self.radius_mm**3

    def to_dict(self) -> dict[str, Any]:
        """JSON values, mm."""
        return {"radius": self.radius_mm, "center": self.center_C.tolist(), "rms": self.rms_mm}


class RansacSphereParams(Params):
    """Parameters of the search."""

    samples: int = Field(200, ge=1, le=10_000, description="Spheres through four vertices that are tried.")
    reach: float = Field(0.005, gt=0, le=0.5, description="Distance within which a vertex counts, as a share of the size.")
    rms_max: float = Field(0.02, gt=0, le=1, description="Largest root mean square distance, as a share of the radius.")
    filled_min: float = Field(0.5, ge=0, le=1, description="Share of the sphere's surface from which it counts as filled.")


class RansacSphereFitter:
    """Fits a sphere to a segment's vertices by random samples (pyransac3d)."""

    key: ClassVar[str] = "ransac_sphere"
    params_model: ClassVar[type[RansacSphereParams]] = RansacSphereParams

    def __init__(self, params: RansacSphereParams) -> None:
        self._params = params

    def fit(self, component: Component, segment: Segment, ctx: RunContext) -> Primitive | Rejection:
        """The sphere on which most vertices lie, or `no-sphere` where the surface is another or is hollow."""
        mesh = component.mesh
        points = mesh.vertices_mm[np.unique(mesh.faces[segment.faces])]  # (n, 3)
        if len(points) < 4:
            return Rejection("no-sphere", f"{len(points)} vertices, at least 4 are needed")
        size_mm = float(np.linalg.norm(np.ptp(points, axis=0)))
        found = self._search(points, size_mm, ctx)
        if not len(found.inliers):
            return Rejection("no-sphere", f"no sphere through four vertices was found in {self._params.samples} samples")
        center, radius = np.array(found.center, dtype=float), float(found.radius)
        if not radius <= size_mm:  # four points in one plane, but for rounding
            return Rejection("no-sphere", f"its radius would be {radius:.3g} mm, at most {size_mm:.3g} mm, the segment's size")
        centres = face_centres_mm(mesh)[segment.faces]  # (k, 3); a box's corners lie on a sphere too, its faces do not
        distances = np.linalg.norm(np.concatenate([points, centres]) - center, axis=1)
        rms = float(np.sqrt(np.mean((distances - radius) ** 2)))
        limit = self._params.rms_max * radius
        if rms > limit:
            return Rejection("no-sphere", f"the surface lies {rms:.3g} mm (rms) off the sphere, at most {limit:.3g} mm")
        if np.mean(((centres - center) * face_normals(mesh)[segment.faces]).sum(axis=1)) < 0.0:
            return Rejection("no-sphere", "the surface is a hollow")
        filled = segment.area_mm2 / (4.0 * np.pi * radius**2) >= self._params.filled_min
        return RansacSphere(center_C=center, radius_mm=radius, rms_mm=rms, surface_filled=bool(filled))

    def _search(self, points_mm: FloatArray, size_mm: float, ctx: RunContext) -> Any:
        """The library's own answer, from coordinates of order 1: its determinants do not bear others well."""
        middle = points_mm.mean(axis=0)

        def tell(state: Any) -> None:
            if state["iteration"] % _TOLD_EVERY == 0:
                ctx.progress(state["iteration"] / self._params.samples, "samples")

        with _seeded(ctx), np.errstate(divide="ignore", invalid="ignore"):  # four points in one plane have no sphere
            found = Sphere().fit((points_mm - middle) / size_mm, self._params.reach, self._params.samples, callback=tell)
        if not len(found.inliers):
            return found
        return type(found)(np.array(found.center) * size_mm + middle, found.radius * size_mm, found.inliers)


@contextmanager
def _seeded(ctx: RunContext) -> Iterator[None]:
    """The library draws from Python's global generator: seed it by the run, and leave it as it was."""
    before = random.getstate()
    random.seed(int(ctx.rng.integers(2**63)))
    try:
        yield
    finally:
        random.setstate(before)
