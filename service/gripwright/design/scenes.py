"""What surrounds the hand in one operation, built from the components and obstacles that take part in it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gripwright.design.grasp_judge import HeldComponent
from gripwright.design.hand_check import OperationScene
from gripwright.domain.affordance import Forbidden
from gripwright.domain.assembly import Component, Obstacle, Operation
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.collision import MeshSurface, PlacedSurface, Scene
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.measures import face_areas_mm2, face_centres_mm, volume_mm3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A component where it takes part in an operation: without its prepared mesh, with its repaired one."""

    component: Component
    solid: Mesh

    @property
    def mass_kg(self) -> float:
        """Mass by the mesh's volume and the component's density."""
        return abs(volume_mm3(self.solid)) * 1e-9 * self.component.density_kg_m3

    @property
    def centroid_C(self) -> FloatArray:
        """Centre of the surface's volume (of its area, for an open mesh), (3,)."""
        a, b, c = np.moveaxis(self.solid.triangles_mm, 1, 0)
        weights = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
        total = weights.sum()
        if abs(total) < 1e-9:
            return np.asarray(np.average(face_centres_mm(self.solid), axis=0, weights=face_areas_mm2(self.solid)))
        return np.asarray((weights[:, None] * (a + b + c) / 4.0).sum(axis=0) / total)


def operation_scene(
    operation: Operation,
    held: Body,
    others: Sequence[Body],
    passive: Sequence[Body],
    obstacles: Sequence[Obstacle],
    margin_mm: float,
    release_clearance_mm: float,
) -> OperationScene:
    """The scene of an operation in which `held` is gripped and the other active components ride along."""
    X_CP = inverse(held.component.X_PC)
    attached = [PlacedSurface(name=held.component.id, surface=_surface(held.solid), X=np.eye(4))]
    attached += [_placed(body, X_CP @ body.component.X_PC) for body in others]
    standing = [_placed(body, body.component.X_PC) for body in passive]
    standing += [PlacedSurface(name=item.id, surface=_surface(item.mesh), X=item.X_PE) for item in obstacles]
    return OperationScene(
        attached=Scene(attached),
        standing=Scene(standing),
        X_PC=held.component.X_PC,
        motion=operation.motion,
        margin_mm=margin_mm,
        release_clearance_mm=release_clearance_mm,
    )


def held_component(
    operation: Operation, held: Body, others: Sequence[Body], prepared: Mesh, forbidden: tuple[Forbidden, ...]
) -> HeldComponent:
    """The gripped component with the mass and centroid of everything that moves with it."""
    bodies = [held, *others]
    masses = np.array([body.mass_kg for body in bodies])
    X_CP = inverse(held.component.X_PC)
    centroids = np.array([transform(X_CP @ body.component.X_PC, body.centroid_C) for body in bodies])
    weights = masses if masses.sum() > 0 else np.ones(len(masses))
    component = Component(
        id=held.component.id,
        mesh=prepared,
        X_PC=held.component.X_PC,
        density_kg_m3=held.component.density_kg_m3,
        friction=held.component.friction,
        texture=held.component.texture,
        ferrous=held.component.ferrous,
    )
    return HeldComponent(
        component=component,
        solid=held.solid,
        forbidden=forbidden,
        centroid_C=np.average(centroids, axis=0, weights=weights),
        mass_kg=float(masses.sum()),
        force_N=operation.force_N,
    )


def _placed(body: Body, X: FloatArray) -> PlacedSurface:
    return PlacedSurface(name=body.component.id, surface=_surface(body.solid), X=X)


@lru_cache(maxsize=1024)
def _surface(mesh: Mesh) -> MeshSurface:
    """One hierarchy for one and the same mesh, in however many operations it stands around."""
    return MeshSurface(mesh)
