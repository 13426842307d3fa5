"""What each handle promises: it touches, enters nothing, stays clear, and lets go."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import trimesh

from checker.contact import PITCH_MM, contact_height
from checker.fault import Fault, Limits
from checker.gripper import Gripper, finger_pose
from checker.motion import Screw, nearest_approach, screws
from checker.package import Body, Operation, Package
from checker.shapes import Array, Shape, placed

FLUSH_MM = 0.01  # lying flush is not entering
GIVING_WAY_MM = (FLUSH_MM, 0.05, 0.2, 1.0)
TOUCH_GAP_MM = 0.05
GAP_TOLERANCE_MM, GAP_TOLERANCE = 0.1, 0.05
GAP_ACCURACY = 0.04

Finding = tuple[str, str]  # promise, detail


@dataclass(frozen=True, eq=False)
class Scene:
    """A gripper holding a component; everything in the gripper's frame but `hand_in_product`, its pose before displacement."""

    gripper: Gripper
    operation: Operation
    width_mm: float
    release_mm: float
    stated_gap_mm: float | None
    component: Body
    in_hand: Array  # the component's pose in the gripper frame
    hand_in_product: Array
    held: trimesh.Trimesh
    companions: list[trimesh.Trimesh]  # the other active components
    passive: list[trimesh.Trimesh]  # in the product frame, as obstacles are
    obstacles: list[trimesh.Trimesh]

    @classmethod
    def of(cls, gripper: Gripper, handle: dict[str, Any], package: Package) -> Scene:
        operation = package.operations[handle["operation"]]
        component = package.components[handle["component"]]
        grasp = np.array(handle["grasp_pose"], dtype=float)
        hand_in_product = component.pose @ grasp
        to_hand = np.linalg.inv(hand_in_product)
        others = [package.components[name] for name in operation.active if name != component.id]
        return cls(
            gripper=gripper,
            operation=operation,
            width_mm=handle["opening_width"],
            release_mm=handle["release_opening"],
            stated_gap_mm=handle["gap"],
            component=component,
            in_hand=np.linalg.inv(grasp),
            hand_in_product=hand_in_product,
            held=placed(component.mesh, np.linalg.inv(grasp)),
            companions=[placed(other.mesh, to_hand @ other.pose) for other in others],
            passive=[package.components[name].in_product for name in operation.passive],
            obstacles=[body.in_product for body in package.obstacles(operation)],
        )

    @cached_property
    def held_shape(self) -> Shape:
        """The component, gripper frame."""
        return Shape([self.held])

    @cached_property
    def moved_along(self) -> Shape | None:
        """The other active components, gripper frame."""
        return Shape(self.companions) if self.companions else None

    @cached_property
    def passive_shape(self) -> Shape | None:
        """The passive subassembly, product frame."""
        return Shape(self.passive) if self.passive else None

    @cached_property
    def obstacles_shape(self) -> Shape | None:
        """Product frame."""
        return Shape(self.obstacles) if self.obstacles else None

    def around(self, displacement: Array) -> list[tuple[Shape, Array]]:
        """Everything but the held component, each with the gripper's pose in its frame, the active subassembly displaced."""
        hand_in_product = displacement @ self.hand_in_product
        places = ((self.moved_along, np.eye(4)), (self.passive_shape, hand_in_product), (self.obstacles_shape, hand_in_product))
        return [(shape, pose) for shape, pose in places if shape]


def check_handle(gripper: Gripper, handle: dict[str, Any], package: Package, limits: Limits) -> Iterator[Fault]:
    scene = Scene.of(gripper, handle, package)
    findings = [*_touch(scene, limits), *_no_grasp(scene), *_enter(scene), *_clear(scene, limits)]
    if limits.release_clearance > 0:
        findings += [*_leave(scene, "leave", scene.operation.displacements[-1], limits.finer)]
        findings += [*_leave(scene, "take-up", scene.operation.displacements[0], limits.finer)]
    for promise, detail in findings:
        yield Fault(gripper.id, scene.operation.id, promise, detail)


def _touch(scene: Scene, limits: Limits) -> Iterator[Finding]:
    required = min(limits.min_contact, float(np.ptp(scene.held.bounds[:, 2])))
    for i, angle in enumerate(scene.gripper.angles_rad, start=1):
        to_finger = np.linalg.inv(finger_pose(angle, scene.width_mm))
        height = contact_height(scene.gripper.finger, placed(scene.held, to_finger), -scene.gripper.outward)
        if height < required - 1.1 * PITCH_MM:
            yield "touch", f"finger {i} touches {height:.2f} mm high, at least {required:.2f} mm"


def _no_grasp(scene: Scene) -> Iterator[Finding]:
    fingers = Shape(scene.gripper.fingers(scene.width_mm))
    for box in scene.component.no_grasp:
        surface = _cut_to(scene.component.mesh, box)
        if surface is None:
            continue
        distance = fingers.distance(Shape([placed(surface, scene.in_hand)]))
        if distance <= TOUCH_GAP_MM:
            yield "no-grasp", f"a finger comes as near as {distance:.3f} mm to the component inside {box.tolist()}"


def _cut_to(mesh: trimesh.Trimesh, box: Array) -> trimesh.Trimesh | None:
    """The part of the surface well inside the box: a contact that ends at its side is none with what is in it."""
    vertices, faces = mesh.vertices, mesh.faces
    for axis in range(3):
        for sign, bound in ((1.0, box[0] + 2 * TOUCH_GAP_MM), (-1.0, box[1] - 2 * TOUCH_GAP_MM)):
            vertices, faces, _ = trimesh.intersections.slice_faces_plane(vertices, faces, sign * np.eye(3)[axis], bound)
            if len(faces) == 0:
                return None
    return trimesh.Trimesh(vertices, faces, process=False)


def _enter(scene: Scene) -> Iterator[Finding]:
    """The gripper, giving way by as little as flush contact needs, meets no active component."""
    for name, active in (("the component", scene.held_shape), ("another active component", scene.moved_along)):
        if not active:
            continue
        freed = next((give for give in GIVING_WAY_MM if not _meets(scene, active, give)), None)
        if freed != FLUSH_MM:
            depth = f"up to {freed}" if freed else f"over {GIVING_WAY_MM[-1]}"
            yield "enter", f"the gripper enters {name} by {depth} mm"


def _meets(scene: Scene, active: Shape, giving_way_mm: float) -> bool:
    """Whether the gripper, let go and drawn back by so much, still cuts or holds something of the active solids."""
    back = np.eye(4)
    back[2, 3] = -giving_way_mm
    opening = scene.width_mm + 2 * giving_way_mm * scene.gripper.outward
    gripper = Shape([placed(solid, back) for solid in scene.gripper.solids(opening)])
    return gripper.distance(active) == 0 or gripper.is_inside(active)


def _clear(scene: Scene, limits: Limits) -> Iterator[Finding]:
    """Nearest approach to the passive subassembly and to obstacles during the motion, and the gap stated for it."""
    hand = Shape([placed(solid, scene.hand_in_product) for solid in scene.gripper.solids(scene.width_mm)])
    motion = screws(scene.operation.displacements)
    measured: list[float] = []
    for name, standing in (("the passive subassembly", scene.passive_shape), ("an obstacle", scene.obstacles_shape)):
        if not standing:
            continue
        nearest = nearest_approach(hand, standing, motion, limits.margin, GAP_ACCURACY, limits.finer)
        measured.append(nearest.distance_mm)
        if nearest.is_nearer(limits.margin):
            how = "inside" if nearest.inside else f"{nearest.distance_mm:.3f} mm from"
            yield "clear", f"the gripper comes {how} {name} at {nearest.progress:.0%} of the motion, at least {limits.margin} mm"
    stated = scene.stated_gap_mm
    if measured and stated is not None:
        accepted = {min(measured), measured[0]}  # with obstacles, or of the passive subassembly alone
        if all(abs(stated - gap) > max(GAP_TOLERANCE_MM, GAP_TOLERANCE * gap) for gap in accepted):
            yield "gap", f"stated {stated:.3f} mm, measured {min(measured):.3f} mm"
    elif scene.passive and stated is None:
        yield "gap", f"none stated, measured {min(measured):.3f} mm"


def _leave(scene: Scene, promise: str, displacement: Array, finer: int) -> Iterator[Finding]:
    """Opened to the release opening, the gripper withdraws along -z past everything and touches nothing."""
    around = scene.around(displacement)
    yield from _opening(scene, promise, around, finer)
    lowest = min([scene.held.bounds[0, 2], *(_lowest(shape, pose) for shape, pose in around)])
    back = np.array([0.0, 0.0, min(lowest, 0.0) - 1.0])
    hand = Shape(scene.gripper.solids(scene.release_mm))
    standing = [("the component", scene.held_shape, np.eye(4))]
    standing += [("something standing around", shape, pose) for shape, pose in around]
    for name, shape, pose in standing:
        nearest = nearest_approach(hand, shape, [Screw.straight(back, pose)], TOUCH_GAP_MM, 1.0, finer)
        if nearest.is_nearer(TOUCH_GAP_MM):
            how = "inside" if nearest.inside else f"{nearest.distance_mm:.3f} mm from"
            way_mm = -nearest.progress * back[2]
            yield promise, f"opened to {scene.release_mm:.3f} mm, {way_mm:.1f} mm back, the gripper comes {how} {name}"


def _lowest(shape: Shape, hand_pose: Array) -> float:
    """The least z of a shape in the gripper's frame."""
    return float(((shape.vertices - hand_pose[:3, 3]) @ hand_pose[:3, 2]).min())


def _opening(scene: Scene, promise: str, around: list[tuple[Shape, Array]], finer: int) -> Iterator[Finding]:
    """Each finger's own way from the grip to the release opening."""
    travel = (scene.release_mm - scene.width_mm) / 2
    for i, angle in enumerate(scene.gripper.angles_rad, start=1):
        finger = Shape([placed(scene.gripper.finger, finger_pose(angle, scene.width_mm))])
        out = travel * np.array([np.cos(angle), np.sin(angle), 0.0])
        ways = [(shape, Screw.straight(out, pose)) for shape, pose in around]
        if any(nearest_approach(finger, shape, [way], TOUCH_GAP_MM, 1.0, finer).is_nearer(TOUCH_GAP_MM) for shape, way in ways):
            yield promise, f"finger {i} runs into something standing around while it opens"
        way = Screw.straight(out)
        times = np.linspace(0, 1, 2 + finer * int(abs(travel) / 0.1))[1:]
        if any(finger.distance(scene.held_shape, way.displacement(t)) == 0 for t in times):
            yield promise, f"finger {i} runs into the component while it opens"
