"""A whole gripper: fingers on the actuator's jaws and the actuator's body, in the gripper frame G. Lengths in mm.

Along z, from the tips back: stems (0 .. −L), bases of the fingers, jaws, body.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gripwright.design.catalogue import actuator_envelope_mm, opening_reference_mm
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import Actuator, FingerDesign, Gripper, JawInterface
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.frames import transform
from gripwright.plugin_api.contracts import HandModel

if TYPE_CHECKING:  # the CAD kernel takes most of a second, and whoever reads measures from a record needs none
    from gripwright.geometry import brep

_GUIDE_MM = 5.0  # depth of the guides along z
_HOUSING_MIN_MM = 10.0  # length of the actuator behind its jaws, at least

STANDARD_JAWS = (
    JawInterface(),
    JawInterface(
        depth_mm=10.0,
        width_mm=24.0,
        bolt_setback_mm=5.5,
        bolt_pitch_mm=17.0,
        bolt_thread_mm=3.0,
    ),
    JawInterface(depth_mm=7.0, width_mm=20.0, bolt_setback_mm=3.8, bolt_pitch_mm=15.6, bolt_thread_mm=2.5, pin_diameter_mm=2.0),
)
"""Jaws, large to small, that stand for an actuator's own: no maker's interface is in the catalogue."""

FINGER_COLOUR = (0.85, 0.55, 0.20)
PAD_COLOUR = (0.12, 0.12, 0.13)
JAW_COLOUR = (0.55, 0.58, 0.62)
BODY_COLOUR = (0.25, 0.28, 0.32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GripperPart:
    """One part of a gripper for display: its mesh in the gripper frame and an RGB colour (0..1)."""

    name: str
    mesh: Mesh
    colour: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyMeasures:
    """The actuator behind the fingers: where its jaws' front faces are in the gripper frame, and its size.

    A centric actuator is a cylinder; a parallel one is a block in the circle of that diameter, twice as long along the
    grip direction as across, but as wide as its jaws where the circle allows it.
    """

    front_mm: float  # z of the jaws' front faces, which carry the fingers' bases
    diameter_mm: float
    length_mm: float  # jaws included

    def sides_mm(self, jaw: JawInterface) -> tuple[float, float]:
        """Length along the grip direction and width across it, of a block."""
        width = max(self.diameter_mm / np.sqrt(5.0), min(jaw.width_mm, self.diameter_mm / np.sqrt(2.0)))
        return float(np.sqrt(self.diameter_mm**2 - width**2)), float(width)


def jaw_radius_mm(gripper: Gripper, opening_width_mm: float) -> float:
    """Distance of the jaws' reference faces from the gripper's axis at this opening."""
    return opening_width_mm / 2.0 - gripper.jaw_offset_mm


def jaw_of(actuator: Actuator) -> JawInterface:
    """The jaws of an actuator: the largest standard ones within the room that its body and open jaws take, or the smallest."""
    reference, room = opening_reference_mm(actuator) / 2.0, actuator_envelope_mm(actuator)
    whole = (jaw for jaw in STANDARD_JAWS if np.hypot(reference + jaw.depth_mm, jaw.width_mm / 2.0) <= room)
    return next(whole, STANDARD_JAWS[-1])


def body_shape(gripper: Gripper, hand: HandModel, measures: BodyMeasures, jaw: JawInterface) -> "brep.Shape":
    """Actuator and jaws as one exact solid that stands still: each jaw fills what it sweeps over the opening range.

    What holds by a face has no jaws: the body itself carries it. Guides join the jaws to a body narrower than their travel.
    Jaws and guides keep to the palm envelope.
    """
    from gripwright.geometry import brep

    swept = (jaw_radius_mm(gripper, gripper.opening_min_mm), jaw_radius_mm(gripper, gripper.opening_max_mm) + jaw.depth_mm)
    front, back = measures.front_mm, measures.front_mm - jaw.height_mm
    shape = _actuator(gripper, measures, jaw)
    if gripper.grip == SURFACE:
        return brep.single_solid(shape)
    room = brep.cylinder_z(0.0, 0.0, gripper.envelope_mm, back - _GUIDE_MM, front)
    for X_GF in hand.finger_poses(gripper.opening_max_mm):
        shape = brep.fuse(shape, brep.common(_bar(X_GF, swept, jaw.width_mm, back, front), room))
        shape = brep.fuse(shape, brep.common(_bar(X_GF, (0.0, swept[1]), jaw.width_mm, back - _GUIDE_MM, back), room))
    return brep.single_solid(shape)


def gripper_parts(
    gripper: Gripper, hand: HandModel, finger: FingerDesign, measures: BodyMeasures, jaw: JawInterface, opening_width_mm: float
) -> list[GripperPart]:
    """The gripper at one opening, part by part: actuator, jaws, fingers and their pads."""
    from gripwright.geometry import brep

    radius = jaw_radius_mm(gripper, opening_width_mm)
    front, back = measures.front_mm, measures.front_mm - jaw.height_mm
    poses = hand.finger_poses(opening_width_mm)
    body = brep.tessellate(_actuator(gripper, measures, jaw))
    carried = () if gripper.grip == SURFACE else poses
    jaws = [brep.tessellate(_bar(X, (radius, radius + jaw.depth_mm), jaw.width_mm, back, front)) for X in carried]
    bonded = finger.bonded
    fingers = placed_fingers(finger.mesh if bonded is None else bonded.bare.mesh, poses)
    pads = [] if bonded is None else placed_fingers(bonded.pad.mesh, poses)
    return [
        GripperPart(name="actuator", mesh=body, colour=BODY_COLOUR),
        *(GripperPart(name=f"jaw-{i}", mesh=mesh, colour=JAW_COLOUR) for i, mesh in enumerate(jaws, start=1)),
        *(GripperPart(name=f"finger-{i}", mesh=mesh, colour=FINGER_COLOUR) for i, mesh in enumerate(fingers, start=1)),
        *(GripperPart(name=f"pad-{i}", mesh=mesh, colour=PAD_COLOUR) for i, mesh in enumerate(pads, start=1)),
    ]


def placed_fingers(finger: Mesh, poses_GF: FloatArray) -> list[Mesh]:
    """The finger's mesh at each of the hand's finger poses (fingers, 4, 4), in the gripper frame."""
    return [Mesh(vertices_mm=transform(X_GF, finger.vertices_mm), faces=finger.faces) for X_GF in poses_GF]


def reach_mm(mesh: Mesh, axis_x_mm: float = 0.0) -> float:
    """Largest distance of a mesh from the axis parallel to z through (axis_x, 0)."""
    return float(np.linalg.norm(mesh.vertices_mm[:, :2] - [axis_x_mm, 0.0], axis=1).max())


def _actuator(gripper: Gripper, measures: BodyMeasures, jaw: JawInterface) -> "brep.Shape":
    from gripwright.geometry import brep

    front = measures.front_mm - (0.0 if gripper.grip == SURFACE else jaw.height_mm)
    back = min(measures.front_mm - measures.length_mm, front - _HOUSING_MIN_MM)
    if gripper.fingers != 2:
        return brep.cylinder_z(0.0, 0.0, measures.diameter_mm / 2.0, back, front)
    x, y = (side / 2.0 for side in measures.sides_mm(jaw))
    return brep.box((-x, -y, back), (x, y, front))


def _bar(X_GF: FloatArray, radii_mm: Sequence[float], width_mm: float, z_min_mm: float, z_max_mm: float) -> "brep.Shape":
    """A bar along the x axis of a finger's pose, between two distances from the gripper's axis."""
    from gripwright.geometry import brep

    along, across = X_GF[:2, 0], X_GF[:2, 1] * width_mm / 2.0
    inner, outer = along * radii_mm[0], along * radii_mm[1]
    return brep.prism_z(np.array([inner - across, outer - across, outer + across, inner + across]), z_min_mm, z_max_mm)
