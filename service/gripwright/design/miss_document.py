"""A nearest miss, and a taper, as design.json holds them. Lengths in mm, forces in N, angles in degrees."""

from typing import Any

import numpy as np

from gripwright.domain.grasp import NearestMiss


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
        **taper_document(0.0 if miss.grasp is None else miss.grasp.taper_rad),
        "opening_width": _figure(miss.opening_width_mm),
        "finger_length": _figure(miss.finger_length_mm),
        "palm_radius": _figure(miss.palm_radius_mm),
        "grasp": None if miss.grasp is None else miss.grasp.label,
        "grasp_pose": None if miss.grasp is None else np.round(miss.grasp.X_CG, 9).tolist(),
    }


def taper_document(taper_rad: float) -> dict[str, float]:
    """What is said of the taper of tips; nothing of straight ones."""
    return {"taper": round(float(np.degrees(taper_rad)), 4)} if taper_rad else {}


def _figure(value: float | None) -> float | None:
    return None if value is None else round(float(value), 4)
