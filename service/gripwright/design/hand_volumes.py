"""All that a hand passes through in one operation, one convex solid after the other, and how far things reach into each.

The same volumes as `hand_check` asks about, each apart and with its name: that one answers whether, this one by how much.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gripwright.design.hand_check import (
    BEHIND_MM,
    LENGTH_LIMIT_MM,
    ROUGH_MM,
    OperationScene,
    drawn_back,
    leaving,
    way_length_mm,
)
from gripwright.design.motion import path_mm, sampled, stretches
from gripwright.design.sweeps import step_solid
from gripwright.design.tapered_hand import leaving_mm, way_out
from gripwright.domain.grasp import Grasp, letting_go
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.geometry.collision import ConvexShape, PlacedSurface, Scene
from gripwright.geometry.frames import inverse, transform
from gripwright.geometry.penetration import Halfspaces, Penetration, Triangles, penetration, surface_penetration
from gripwright.geometry.solids import dilated, swept
from gripwright.plugin_api import HandModel

TAKING_UP, CLOSING, MOTION, OPENING, LEAVING = "taking-up", "closing", "motion", "opening", "leaving"
Measure = Callable[[Halfspaces, Triangles, FloatArray], Penetration | None]
_WHOLE_MM = 0.02
_SHARE = 2e-3  # of the way between two of these
_PLACES = 64  # along a motion, to find where something first comes too near


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Volume:
    """What one part of the hand passes through in one phase, with the margin that is asked of it."""

    part: str  # "finger 2", "palm"
    phase: str
    margin_mm: float
    vertices: FloatArray  # (n, 3) the margin included
    X: FloatArray  # (4, 4) pose in the scene's frame
    scene: Scene
    X_PS: FloatArray  # (4, 4) the scene's frame seen from the product's, in this phase
    resting: FloatArray | None = None  # (n, 3) of a sweep: the solid that moves, the margin included, in frame B
    X_PB: FloatArray | None = None  # (4, 4) where that frame stands when the subassembly is not displaced


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intrusion:
    """A body that reaches into a volume: `depth_mm` is the least shift that leads it out, the margin included."""

    volume: Volume
    body: PlacedSurface
    depth_mm: float
    normal: FloatArray  # (3,) of the volume's face through which it leads
    point_P: FloatArray  # (3,) the deepest; of what moves with the component, before the motion

    @property
    def whole(self) -> bool:
        """Whether it takes up all that the volume is thick in that direction."""
        return self.depth_mm >= self.size_mm - _WHOLE_MM

    @property
    def size_mm(self) -> float:
        """How thick the volume is in that direction, without its margin."""
        return float(np.ptp(self.volume.vertices @ self.normal)) - 2.0 * self.volume.margin_mm


class HandVolumes:
    """The volumes of one hand in one operation. Shapes are kept for the next grasp that needs the same."""

    def __init__(self, scene: OperationScene, hand: HandModel) -> None:
        self._scene, self._hand = scene, hand
        self._way = stretches(scene.motion)
        self._far = scene.far_mm
        self._shapes: dict[bytes, tuple[ConvexShape, Halfspaces]] = {}
        self._soups: dict[str, Triangles] = {}

    def intrusions(self, volume: Volume) -> Iterator[Intrusion]:
        """What reaches into a volume, and how deep."""
        return self._measured(volume, penetration)

    def glances(self, volume: Volume) -> Iterator[Intrusion]:
        """The same at a glance, by the bodies' surfaces alone: no deeper than it is."""
        return self._measured(volume, surface_penetration)

    def _measured(self, volume: Volume, measure: Measure) -> Iterator[Intrusion]:
        shape, solid = self._shape(volume.vertices)
        X_SC = inverse(volume.X)
        for body in volume.scene.touched(shape, volume.X):
            found = measure(solid, self._triangles(body), X_SC @ body.X)
            if found is not None:
                point_P = transform(volume.X_PS @ volume.X, found.deepest[None])[0]
                yield Intrusion(volume=volume, body=body, depth_mm=found.depth_mm, normal=found.normal, point_P=point_P)

    def _triangles(self, body: PlacedSurface) -> Triangles:
        if body.name not in self._soups:
            self._soups[body.name] = Triangles(body.surface.mesh)
        return self._soups[body.name]

    def _shape(self, vertices: FloatArray) -> tuple[ConvexShape, Halfspaces]:
        key = vertices.tobytes()
        if key not in self._shapes:
            self._shapes[key] = ConvexShape(vertices), Halfspaces(vertices)
        return self._shapes[key]

    def reaching(self, grasp: Grasp, finger_length_mm: float) -> Iterator[Volume]:
        """The open fingers on their way over the component, beside all that moves with it."""
        scene, out = self._scene, self._out(grasp)
        margin = min(scene.margin_mm, abs(out[0]) * 0.8)
        for part, vertices, X_GF in self._leaving(grasp, finger_length_mm):
            grown = dilated(vertices + out, margin)
            if not out.any():
                grown = drawn_back(grown, ROUGH_MM, grasp)
            yield self._attached(part, TAKING_UP, margin, grown, grasp.X_CG @ X_GF)

    def closing(self, grasp: Grasp, finger_length_mm: float, draw_back_mm: float) -> Iterator[Volume]:
        """The fingers while they close on the component; it may come as near as it likes."""
        for part, vertices, X_GF in self._fingers(grasp, finger_length_mm):
            opened = drawn_back(swept(vertices, self._out(grasp)), draw_back_mm, grasp)
            yield self._attached(part, CLOSING, 0.0, opened, grasp.X_CG @ X_GF)

    def leaving(self, grasp: Grasp, finger_length_mm: float) -> Iterator[Volume]:
        """The open fingers on their way out at the end, and in at the start."""
        for part, vertices, X_GF in self._leaving(grasp, finger_length_mm):
            grown = dilated(vertices + self._out(grasp), self._scene.margin_mm)
            for phase, place in ((LEAVING, self._scene.motion[-1]), (TAKING_UP, self._scene.motion[0])):
                yield self._standing(part, phase, grown, place, grasp.X_CG @ X_GF)

    def moving(self, grasp: Grasp, finger_length_mm: float) -> Iterator[Volume]:
        """The fingers while they open at the end and close at the start, and along the motion."""
        margin = self._scene.margin_mm
        for part, vertices, X_GF in self._fingers(grasp, finger_length_mm):
            opened = dilated(swept(vertices, self._out(grasp)), margin)
            for phase, place in ((OPENING, self._scene.motion[-1]), (CLOSING, self._scene.motion[0])):
                yield self._standing(part, phase, opened, place, grasp.X_CG @ X_GF)
            yield from self._along(part, vertices, grasp.X_CG @ X_GF)

    def palm(self, grasp: Grasp, envelope_mm: float, finger_length_mm: float) -> Iterator[Volume]:
        """The palm behind fingers of that length, on its way in and out and along the motion."""
        back = np.eye(4)
        back[2, 3] = -finger_length_mm
        X_CG, margin = grasp.X_CG @ back, self._scene.margin_mm
        for solid in self._hand.palm(0.0, envelope_mm, BEHIND_MM + LENGTH_LIMIT_MM):
            out = swept(dilated(solid.vertices_mm, margin), np.array([0.0, 0.0, -self._far]))
            yield self._attached("the palm", TAKING_UP, margin, out, X_CG)
            for phase, place in ((LEAVING, self._scene.motion[-1]), (TAKING_UP, self._scene.motion[0])):
                yield self._standing("the palm", phase, out, place, X_CG)
            yield from self._along("the palm", solid.vertices_mm, X_CG)

    def first_place(self, found: Intrusion) -> tuple[float, FloatArray] | None:
        """Share of the motion, by path, at which the body first comes too near, and where (product frame)."""
        volume = found.volume
        assert volume.resting is not None
        assert volume.X_PB is not None
        poses = sampled(self._scene.motion, _PLACES)
        lengths = np.array([path_mm(end @ inverse(start)) for start, end in pairwise(poses)])
        shares = np.append(0.0, np.cumsum(lengths)) / max(float(lengths.sum()), 1e-12)
        alone, resting = Scene([found.body]), ConvexShape(volume.resting)
        for k, (start, end) in enumerate(pairwise(poses)):
            X_start, X_end = start @ volume.X_PB, end @ volume.X_PB
            step = self._until(volume.resting, X_start, X_end, 1.0)
            if not alone.touched(ConvexShape(step), X_start):
                continue
            deepest = penetration(Halfspaces(step), self._triangles(found.body), inverse(X_start) @ found.body.X)
            point_P = found.point_P if deepest is None else transform(X_start, deepest.deepest[None])[0]
            low, high = 0.0, 0.0 if alone.touched(resting, X_start) else 1.0
            while high - low > _SHARE:
                middle = (low + high) / 2.0
                hit = alone.touched(ConvexShape(self._until(volume.resting, X_start, X_end, middle)), X_start)
                low, high = (low, middle) if hit else (middle, high)
            return float(shares[k] + high * (shares[k + 1] - shares[k])), point_P
        return None

    def _until(self, vertices: FloatArray, X_start: FloatArray, X_end: FloatArray, share: float) -> FloatArray:
        """A solid at two stations between which the turn is small, up to a share of the way, in its frame at the first."""
        moved = transform(inverse(X_start) @ X_end, vertices)
        return np.concatenate([vertices, vertices + share * (moved - vertices)])

    def _out(self, grasp: Grasp) -> FloatArray:
        out_mm = letting_go(grasp.grip) * (self._scene.release_clearance_mm + leaving_mm(self._hand)) / 2.0
        return np.array([out_mm, 0.0, 0.0])

    def _leaving(self, grasp: Grasp, finger_length_mm: float) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        """As `_fingers`, of what they pass through on their way out."""
        solids = way_out(self._hand, way_length_mm(grasp, finger_length_mm, self._far), grasp.grip)
        for part, vertices, X_GF in self._each(grasp, solids):
            (way,) = leaving([vertices], grasp, self._far)
            yield part, way, X_GF

    def _fingers(self, grasp: Grasp, finger_length_mm: float) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        return self._each(grasp, self._hand.finger(finger_length_mm, grasp.grip))

    def _each(self, grasp: Grasp, solids: Sequence[ConvexSolid]) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        for number, X_GF in enumerate(self._hand.finger_poses(grasp.opening_width_mm), start=1):
            for solid in solids:
                yield f"finger {number}", solid.vertices_mm, X_GF

    def _attached(self, part: str, phase: str, margin_mm: float, vertices: FloatArray, X_CS: FloatArray) -> Volume:
        scene = self._scene
        return Volume(
            part=part,
            phase=phase,
            margin_mm=margin_mm,
            vertices=vertices,
            X=X_CS,
            scene=scene.attached,
            X_PS=scene.motion[0] @ scene.X_PC,
        )

    def _standing(self, part: str, phase: str, vertices: FloatArray, place: FloatArray, X_CS: FloatArray) -> Volume:
        return Volume(
            part=part,
            phase=phase,
            margin_mm=self._scene.margin_mm,
            vertices=vertices,
            X=place @ self._scene.X_PC @ X_CS,
            scene=self._scene.standing,
            X_PS=np.eye(4),
        )

    def _along(self, part: str, vertices: FloatArray, X_CS: FloatArray) -> Iterator[Volume]:
        """What a solid of the hand sweeps, one volume a step of the motion."""
        X_PB, margin = self._scene.X_PC @ X_CS, self._scene.margin_mm
        resting = dilated(vertices, margin)
        for stretch in self._way:
            for number in range(len(stretch.arcs_rad)):
                yield Volume(
                    part=part,
                    phase=MOTION,
                    margin_mm=margin,
                    vertices=step_solid(stretch, number, vertices, margin, X_PB),
                    X=stretch.poses[number] @ X_PB,
                    scene=self._scene.standing,
                    X_PS=np.eye(4),
                    resting=resting,
                    X_PB=X_PB,
                )
