"""A gripper as its design folder gives it: CAD files, opening range, handles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from checker.shapes import Array, load_mesh, placed


def finger_pose(angle_rad: float, opening_mm: float) -> Array:
    """Rz(angle) · Tx(opening / 2)."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    half = opening_mm / 2
    return np.array([[cos, -sin, 0, cos * half], [sin, cos, 0, sin * half], [0, 0, 1, 0], [0, 0, 0, 1.0]])


@dataclass(frozen=True, eq=False)
class Gripper:
    id: str
    record: dict[str, Any]
    finger: trimesh.Trimesh  # finger frame
    body: trimesh.Trimesh  # gripper frame
    bonded: tuple[trimesh.Trimesh, trimesh.Trimesh] | None = None  # finger frame: the finger without its pad, and the pad

    @classmethod
    def read(cls, folder: Path, record: dict[str, Any]) -> Gripper:
        files = record["files"]
        finger, body = load_mesh(folder / files["finger_stl"]), load_mesh(folder / files["body_stl"])
        if "pad_stl" not in files:
            return cls(record["id"], record, finger, body)
        parts = load_mesh(folder / files["finger_bare_stl"]), load_mesh(folder / files["pad_stl"])
        return cls(record["id"], record, finger, body, parts)

    @property
    def is_internal(self) -> bool:
        return bool(self.record["grip"] == "internal")

    @property
    def outward(self) -> float:
        """+1 where letting go opens the gripper, -1 where it closes it."""
        return -1.0 if self.is_internal else 1.0

    @property
    def length_mm(self) -> float:
        return float(self.record["finger_length"])

    @property
    def angles_rad(self) -> list[float]:
        count = int(self.record["fingers"])
        return [2 * np.pi * i / count for i in range(count)]

    def fingers(self, opening_mm: float) -> list[trimesh.Trimesh]:
        """Each finger in the gripper frame."""
        return [placed(self.finger, finger_pose(angle, opening_mm)) for angle in self.angles_rad]

    def solids(self, opening_mm: float) -> list[trimesh.Trimesh]:
        """Fingers and body in the gripper frame."""
        return [*self.fingers(opening_mm), self.body]
