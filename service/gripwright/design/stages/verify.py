"""The finished CAD of a gripper against every promise of INTERFACE.md: touching, entering nothing, clear, leaving.

Two ways at once. By inclusion: the CAD lies within the hand's convex solids, and these are free along the swept motion.
By itself: finger and body meshes as they will be written, placed at the start, at the end and between, cross no surface,
lie inside nothing and touch the component.
"""

from dataclasses import dataclass

import numpy as np

from gripwright.design.finger_lengths import palm_hit
from gripwright.design.hand_check import HandCheck, OperationScene
from gripwright.design.holder import Holder
from gripwright.design.least_gap import least_gap_mm
from gripwright.design.motion import sampled
from gripwright.domain.errors import Rejection
from gripwright.domain.gripper import Gripper, Handle
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.collision import MeshSurface
from gripwright.geometry.frames import transform
from gripwright.geometry.held_surface import Surface
from gripwright.geometry.solids import box_vertices
from gripwright.plugin_api import HandModel, HoldingModel, RunContext

_POSES = 24  # along the motion, besides start and end


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandleReport:
    """What was found of one handle: the faults, and the least distance to the passive subassembly.

    None: there is none, or there is no CAD to measure.
    """

    operation: str
    faults: tuple[str, ...]
    gap_mm: float | None


def verify_handle(
    gripper: Gripper,
    handle: Handle,
    finger: Mesh,
    body: Mesh,
    hand: HandModel,
    scene: OperationScene,
    solid: Mesh,
    ctx: RunContext,
    model: HoldingModel | None = None,
) -> HandleReport:
    """Check one handle with the gripper's CAD: finger in frame F, body in frame G. `model`: what holds, None: jaws."""
    placed = _PlacedGripper(hand, finger, body)
    faults = [
        *_touch(gripper, handle, solid, hand, Holder(model=model, ctx=ctx)),
        *_swept(gripper, handle, hand, scene),
        *placed.entered(handle, scene),
    ]
    gap = placed.gap(handle, scene)
    if gap is not None and gap < scene.margin_mm - 1e-6:
        faults.append(f"the gap to the passive subassembly is {gap:.3f} mm, at least {scene.margin_mm} mm")
    return HandleReport(operation=handle.operation, faults=tuple(dict.fromkeys(faults)), gap_mm=gap)


def verify_owned(
    gripper: Gripper,
    handle: Handle,
    hand: HandModel,
    scene: OperationScene,
    solid: Mesh,
    ctx: RunContext,
    model: HoldingModel | None = None,
) -> HandleReport:
    """Check one handle of a gripper that is at hand by its hand model alone: there is no CAD of it, and no gap is measured."""
    faults = [*_touch(gripper, handle, solid, hand, Holder(model=model, ctx=ctx)), *_swept(gripper, handle, hand, scene)]
    return HandleReport(operation=handle.operation, faults=tuple(dict.fromkeys(faults)), gap_mm=None)


def _touch(gripper: Gripper, handle: Handle, solid: Mesh, hand: HandModel, holder: Holder) -> list[str]:
    found = holder.contacts(handle.grasp, Surface(solid), hand, gripper.finger_length_mm)
    return [found.detail] if isinstance(found, Rejection) else []


def _swept(gripper: Gripper, handle: Handle, hand: HandModel, scene: OperationScene) -> list[str]:
    check = HandCheck(scene, hand)
    stems = check.seated(handle.grasp, gripper.finger_length_mm)
    palm = palm_hit(check, handle.grasp, gripper.envelope_mm, gripper.finger_length_mm)
    faults = [] if stems is None else [stems.detail]
    return faults if palm is None else [*faults, f"the palm hits {palm} with fingers of {gripper.finger_length_mm:g} mm"]


class _PlacedGripper:
    """Finger and body meshes with their hierarchies, to be placed at any opening."""

    def __init__(self, hand: HandModel, finger: Mesh, body: Mesh) -> None:
        self._hand = hand
        self._finger, self._body = MeshSurface(finger), MeshSurface(body)

    def parts(self, handle: Handle, opening_mm: float, X_G: FloatArray) -> list[tuple[str, MeshSurface, FloatArray]]:
        """Name, surface and pose of each part, the gripper standing at X_G."""
        fingers = [
            (f"finger {i}", self._finger, X_G @ X_GF) for i, X_GF in enumerate(self._hand.finger_poses(opening_mm), start=1)
        ]
        return [*fingers, ("the body", self._body, X_G)]

    def entered(self, handle: Handle, scene: OperationScene) -> list[str]:
        """What the gripper's parts cross or lie in: the component they hold, and the standing scene from start to end."""
        faults = []
        for opening, words in ((handle.opening_width_mm, ""), (handle.release_opening_mm, ", open")):
            for name, surface, X in self.parts(handle, opening, handle.grasp.X_CG):
                hit = scene.attached.first_surface_hit(surface, X) or scene.attached.inside(_corner(surface, X))
                if hit is not None:
                    faults.append(f"{name} enters {hit}{words}")
        for place in sampled(scene.motion, _POSES):
            for name, surface, X in self.parts(handle, handle.opening_width_mm, place @ scene.X_PC @ handle.grasp.X_CG):
                hit = scene.standing.first_surface_hit(surface, X) or scene.standing.inside(_corner(surface, X))
                if hit is not None:
                    faults.append(f"{name} enters {hit} on the way")
        return faults

    def gap(self, handle: Handle, scene: OperationScene) -> float | None:
        """Least distance to the standing scene along the motion, mm."""
        if not len(scene.standing):
            return None
        parts = self.parts(handle, handle.opening_width_mm, np.eye(4))
        corners = np.concatenate([transform(X, _box_corners(surface)) for _, surface, X in parts])

        def distance(X_PG: FloatArray, limit_mm: float) -> float:
            for _, surface, X_GB in parts:
                limit_mm = scene.standing.surface_distance(surface, X_PG @ X_GB, limit_mm)
            return limit_mm

        return least_gap_mm(scene.motion, scene.X_PC @ handle.grasp.X_CG, corners, distance)


def _box_corners(surface: MeshSurface) -> FloatArray:
    centre, half = surface.bounds
    return box_vertices(centre - half, centre + half)


def _corner(surface: MeshSurface, X: FloatArray) -> FloatArray:
    return np.asarray(X[:3, :3] @ surface.mesh.vertices_mm[0] + X[:3, 3])
