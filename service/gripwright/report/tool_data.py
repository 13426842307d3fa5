"""A gripper as a tool for simulation: tool.json and gripper.urdf.

The flange frame stands on the gripper's axis at the back of the actuator, its axes those of the gripper frame; the tool
centre point is the gripper frame itself, at the fingertips. A finger's joint is zero where the gripper is closed
(`opening_min`) and moves outwards by half of what the opening grows. What holds by a face is fixed to the body.
"""

import json
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from gripwright.design.catalogue import mass_or_default_kg
from gripwright.design.miss_document import tip_document
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import Gripper
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.plugin_api import HandModel

BODY, TCP = "body", "tcp"
_METRES = 1e-3
_VELOCITY_M_S = 0.1  # of a finger: no maker's figure is in the catalogue, and URDF asks for one
_DECIMALS = 9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A solid of even density: its mass, its centre of gravity and the inertia about it, in the frame of its mesh."""

    mass_kg: float
    centre_mm: FloatArray  # (3,)
    inertia_kg_m2: FloatArray  # (3, 3)


def tool_json(gripper: Gripper, cad: GripperCad) -> str:
    """TCP, mass, centre of gravity and both states of a gripper; mm and kg, flange frame, joints in m."""
    X_LG = flange_pose(cad)
    body, finger = _actuator(gripper, cad), solid_body(cad.finger.mesh, cad.finger.mass_kg)
    mass_kg = body.mass_kg + gripper.fingers * finger.mass_kg
    centre_z = (body.mass_kg * body.centre_mm[2] + gripper.fingers * finger.mass_kg * finger.centre_mm[2]) / mass_kg
    side = body.mass_kg * body.centre_mm[:2] / mass_kg  # the fingers balance each other
    document = {
        "gripper": gripper.id,
        "gripper_type": gripper.gripper_type,
        "fingers": gripper.fingers,
        "grip": gripper.grip,
        "tcp": _rounded(X_LG),
        "mass": _rounded(mass_kg),
        "actuator_mass_known": gripper.actuator.mass_kg is not None,
        "centre_of_gravity": _rounded(np.array([*side, centre_z]) + X_LG[:3, 3]),
        "finger_length": _rounded(gripper.finger_length_mm),
        **tip_document(gripper.taper_rad, gripper.vee),
        "open": _state(gripper, gripper.opening_max_mm),
        "closed": _state(gripper, gripper.opening_min_mm),
        "actuator": {
            "maker": gripper.actuator.maker,
            "model": gripper.actuator.model,
            "stroke": gripper.actuator.stroke_mm,
            "grip_force": gripper.actuator.grip_force_N,
            "grip_force_max": cad.grip_force_max_N,
        },
    }
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False)


def gripper_urdf(gripper: Gripper, cad: GripperCad, hand: HandModel) -> str:
    """The gripper as a robot description: a body, and a prismatic joint for each finger, which follow the first one.

    A joint's effort is its share of the force that the fingers are made for. A face stands still.
    """
    X_LG = flange_pose(cad)
    robot = Element("robot", name=gripper.id)
    _link(robot, BODY, "body.stl", X_LG, _actuator(gripper, cad))
    finger = solid_body(cad.finger.mesh, cad.finger.mass_kg)
    for i, X_GF in enumerate(hand.finger_poses(gripper.opening_min_mm), start=1):
        name = f"finger-{i}"
        _link(robot, name, "finger.stl", np.eye(4), finger)
        if gripper.grip == SURFACE:
            _joint(robot, f"{name}-joint", "fixed", name, X_LG @ X_GF)
            continue
        joint = _joint(robot, f"{name}-joint", "prismatic", name, X_LG @ X_GF)
        SubElement(joint, "axis", xyz="1 0 0")
        SubElement(
            joint,
            "limit",
            lower="0",
            upper=_text(_travel_m(gripper, gripper.opening_max_mm)),
            effort=_text(cad.spec.grip_force_N / gripper.fingers),
            velocity=_text(_VELOCITY_M_S),
        )
        if i > 1:
            SubElement(joint, "mimic", joint="finger-1-joint", multiplier="1", offset="0")
    SubElement(robot, "link", name=TCP)
    _joint(robot, "tcp-joint", "fixed", TCP, X_LG)
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def flange_pose(cad: GripperCad) -> FloatArray:
    """X_LG: the gripper frame seen from the flange at the actuator's back."""
    pose = np.eye(4)
    pose[2, 3] = -float(cad.body.vertices_mm[:, 2].min())
    return pose


def solid_body(mesh: Mesh, mass_kg: float) -> Body:
    """The body of even density and this mass within a closed mesh, by tetrahedra from the origin to each face."""
    corners = mesh.triangles_mm  # (m, 3, 3)
    sixfold = np.linalg.det(corners)  # (m,) six times the signed volume of each tetrahedron
    sums = corners.sum(axis=1)  # (m, 3)
    volume_mm3 = sixfold.sum() / 6.0
    centre = sixfold @ sums / 24.0 / volume_mm3
    second = np.einsum("m,mki,mkj->ij", sixfold, corners, corners) + np.einsum("m,mi,mj->ij", sixfold, sums, sums)
    moments = second / 120.0 / volume_mm3 - np.outer(centre, centre)  # (3, 3) mm², about the centre
    inertia = mass_kg * (np.trace(moments) * np.eye(3) - moments) * _METRES**2
    return Body(mass_kg=mass_kg, centre_mm=centre, inertia_kg_m2=inertia)


def _actuator(gripper: Gripper, cad: GripperCad) -> Body:
    return solid_body(cad.body, mass_or_default_kg(gripper.actuator))


def _travel_m(gripper: Gripper, opening_mm: float) -> float:
    return (opening_mm - gripper.opening_min_mm) / 2.0 * _METRES


def _state(gripper: Gripper, opening_mm: float) -> dict[str, Any]:
    return {"opening": _rounded(opening_mm), "joint": _rounded(_travel_m(gripper, opening_mm))}


def _link(robot: Element, name: str, mesh: str, X_LM: FloatArray, body: Body) -> None:
    """A link whose mesh, and the body within it, stand at X_LM, turned by nothing."""
    link = SubElement(robot, "link", name=name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=_vector((X_LM[:3, 3] + body.centre_mm) * _METRES), rpy="0 0 0")
    SubElement(inertial, "mass", value=_text(body.mass_kg))
    tensor = body.inertia_kg_m2
    SubElement(
        inertial,
        "inertia",
        {f"i{'xyz'[i]}{'xyz'[j]}": f"{round(float(tensor[i, j]), 15) + 0.0:.9g}" for i in range(3) for j in range(i, 3)},
    )
    for purpose in ("visual", "collision"):
        element = SubElement(link, purpose)
        SubElement(element, "origin", xyz=_vector(X_LM[:3, 3] * _METRES), rpy="0 0 0")
        SubElement(SubElement(element, "geometry"), "mesh", filename=mesh, scale=_vector(np.full(3, _METRES)))


def _joint(robot: Element, name: str, kind: str, child: str, X_LC: FloatArray) -> Element:
    """A joint from the body to `child`, which stands at X_LC, turned about z at most."""
    joint = SubElement(robot, "joint", name=name, type=kind)
    yaw = float(np.arctan2(X_LC[1, 0], X_LC[0, 0]))
    SubElement(joint, "origin", xyz=_vector(X_LC[:3, 3] * _METRES), rpy=f"0 0 {_text(yaw)}")
    SubElement(joint, "parent", link=BODY)
    SubElement(joint, "child", link=child)
    return joint


def _vector(values: FloatArray) -> str:
    return " ".join(_text(value) for value in values)


def _text(value: float) -> str:
    return f"{round(float(value), _DECIMALS) + 0.0:.12g}"


def _rounded(value: Any) -> Any:
    """Figures for JSON, without negative zeros."""
    return (np.round(value, _DECIMALS) + 0.0).tolist()
