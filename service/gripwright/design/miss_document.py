"""A nearest miss, and what tips are like, as design.json holds them. Lengths in mm, forces in N, angles in degrees."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gripwright.domain.grasp import NearestMiss
from gripwright.domain.v_tip import Vee


def miss_document(miss: NearestMiss) -> dict[str, Any]:
    """The grasp, what it misses, and by how much."""
    return {
        "code": miss.code,
        "sentence": miss.sentence,
        "quantity": miss.quantity,
        "found": _figure(miss.found),
        "limit": _figure(miss.limit),
        "amount": _figure(miss.amount),
        "unit": miss.unit,
        "part": miss.part,
        "side": miss.side,
        "hit": miss.hit,
        "phase": miss.phase,
        "place": _figure(miss.place),
        "point": None if miss.point_P is None else np.round(miss.point_P, 4).tolist(),
        "gripper_type": miss.gripper_type,
        "grip": miss.grip,
        **({} if miss.grasp is None else tip_document(miss.grasp.taper_rad, miss.grasp.vee)),
        "opening_width": _figure(miss.opening_width_mm),
        "finger_length": _figure(miss.finger_length_mm),
        "palm_radius": _figure(miss.palm_radius_mm),
        "grasp": None if miss.grasp is None else miss.grasp.label,
        "grasp_pose": None if miss.grasp is None else np.round(miss.grasp.X_CG, 9).tolist(),
    }


def tip_document(taper_rad: float, vee: Vee | None) -> dict[str, float]:
    """What is said of the taper and the V of tips; nothing of straight ones."""
    taper = {"taper": round(float(np.degrees(taper_rad)), 4)} if taper_rad else {}
    return taper if vee is None else taper | {"v_angle": round(vee.degrees, 4), "v_depth": round(vee.depth_mm, 4)}


def vee_of_document(document: Mapping[str, Any]) -> Vee | None:
    """The V that a document says of tips; None: it says nothing."""
    angle = document.get("v_angle")
    return None if angle is None else Vee(angle_rad=float(np.radians(angle)), depth_mm=document["v_depth"])


def _figure(value: float | None) -> float | None:
    return None if value is None else round(float(value), 4)
