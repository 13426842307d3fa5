"""A tiny product and a sound design of it, made by hand: a block, a pin and a ring set down on a plate."""

from __future__ import annotations

import copy
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from checker.grippers import FILES
from checker.shapes import Array


def box(low: list[float], high: list[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def finger(length_mm: float, stem_mm: float, base_mm: float, half_width_mm: float) -> trimesh.Trimesh:
    """A straight stem of the given thickness on a thicker base 5 mm high."""
    stem = box([0, -half_width_mm, -length_mm], [stem_mm, half_width_mm, 0])
    base = box([0, -half_width_mm, -length_mm - 5], [base_mm, half_width_mm, -length_mm])
    return trimesh.boolean.union([stem, base])


def round_finger(length_mm: float, radius_mm: float, base_mm: float) -> trimesh.Trimesh:
    """A pin that holds a bore from inside, on a base 5 mm high."""
    stem = tube(radius_mm, -length_mm, 0).apply_translation([-radius_mm, 0, 0])
    base = box([-base_mm, -radius_mm, -length_mm - 5], [0, radius_mm, -length_mm])
    return trimesh.boolean.union([stem, base])


def tube(radius_mm: float, low_mm: float, high_mm: float, bore_mm: float = 0.0) -> trimesh.Trimesh:
    """Along z, of 96 facets whose middles touch the radius."""
    outside = np.cos(np.pi / 96)
    height = high_mm - low_mm
    solid = trimesh.creation.cylinder(radius_mm / outside, height, sections=96)
    if bore_mm:
        solid = trimesh.boolean.difference([solid, trimesh.creation.cylinder(bore_mm / outside, 2 * height, sections=96)])
    return solid.apply_translation([0, 0, (low_mm + high_mm) / 2]).apply_transform(turned(np.pi / 96))


def shifted(x: float, y: float, z: float) -> Array:
    return np.array([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1.0]])


def turned(angle_rad: float, about: tuple[float, float] = (0.0, 0.0)) -> Array:
    """A turn about an axis along z."""
    return np.asarray(trimesh.transformations.rotation_matrix(angle_rad, [0, 0, 1], [*about, 0]))


def from_above(tip_mm: float) -> Array:
    """The gripper looks down, its tips at that height of the component."""
    return np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, tip_mm], [0, 0, 0, 1.0]])


@dataclass
class Bench:
    """Documents and meshes of a package and its design; change them, then write them."""

    product: dict[str, Any]
    design: dict[str, Any]
    parts: dict[str, trimesh.Trimesh]
    fingers: dict[str, trimesh.Trimesh]
    bodies: dict[str, trimesh.Trimesh]
    bonded: dict[str, list[trimesh.Trimesh]]  # of grippers whose fingers carry a pad: the bare finger, the pad

    def gripper(self, name: str) -> dict[str, Any]:
        return next(gripper for gripper in self.design["grippers"] if gripper["id"] == name)

    def handle(self, name: str) -> dict[str, Any]:
        """The gripper's only handle."""
        handle: dict[str, Any] = self.gripper(name)["handles"][0]
        return handle

    def component(self, name: str) -> dict[str, Any]:
        return next(component for component in self.product["components"] if component["id"] == name)

    def operation(self, name: str) -> dict[str, Any]:
        return next(operation for operation in self.product["operations"] if operation["id"] == name)

    def put_in_the_way(self, obstacle: trimesh.Trimesh) -> None:
        """An obstacle in the product frame that the design knew nothing of."""
        self.parts["obstacle"] = obstacle
        self.product["environment"].append({"id": "obstacle", "file": "obstacle.stl", "units": "mm", "pose": np.eye(4).tolist()})

    def write(self, folder: Path) -> tuple[Path, Path]:
        """The design folder and the package."""
        package, design = folder / "package", folder / "design"
        package.mkdir()
        (package / "product.json").write_text(json.dumps(self.product))
        for name, mesh in self.parts.items():
            mesh.export(package / f"{name}.stl")
        for name in self.fingers:
            place = design / "grippers" / name
            place.mkdir(parents=True)
            for file in FILES:
                (place / file).touch()
            self.fingers[name].export(place / "finger.stl")
            self.bodies[name].export(place / "body.stl")
        for name, parts in self.bonded.items():
            for part, mesh in zip(("finger_bare", "pad"), parts, strict=True):
                self.gripper(name)["files"][f"{part}_stl"] = f"grippers/{name}/{part}.stl"
                mesh.export(design / "grippers" / name / f"{part}.stl")
        for file in ("bom.csv", "report.html"):
            (design / file).touch()
        (design / "design.json").write_text(json.dumps(self.design))
        return design, package


def write_set_down(folder: Path, shapes: dict[str, trimesh.Trimesh]) -> None:
    """A package in which each shape, modelled where it stands, is set down from above on the first, the plate."""
    plate, *others = shapes
    for name, shape in shapes.items():
        shape.export(folder / f"{name}.stl")
    components = [{"id": name, "file": f"{name}.stl", "units": "mm", "density": 1500, "friction": 0.35} for name in shapes]
    operations = [
        {
            "id": f"op-{name}",
            "active": [name],
            "passive": [plate],
            "pose_before": shifted(0, 0, 80).tolist(),
            "pose_after": np.eye(4).tolist(),
        }
        for name in others
    ]
    product = {"part_number": "T-1", "revision": "A", "name": "Set down", "components": components, "operations": operations}
    (folder / "product.json").write_text(json.dumps(product))


def sound_bench() -> Bench:
    """A package and a design that keeps every promise; gaps follow from the heights of tips over the plate."""
    return copy.deepcopy(_SOUND)


def _component(name: str, pose: Array) -> dict[str, Any]:
    return {"id": name, "file": f"{name}.stl", "units": "mm", "pose": pose.tolist()}


def _operation(number: int, active: str, passive: list[str], displacements: list[Array]) -> dict[str, Any]:
    before, *between, after = [pose.tolist() for pose in displacements]
    return {
        "id": f"op-0{number}",
        "active": [active],
        "passive": passive,
        "pose_before": before,
        "pose_after": after,
        "waypoints": between,
    }


def _gripper(number: int, fingers: int, openings: tuple[float, float], length: float, handle: dict[str, Any]) -> dict[str, Any]:
    low, high = openings
    name = f"G{number}"
    return {
        "id": name,
        "gripper_type": "parallel-2" if fingers == 2 else "centric-3",
        "fingers": fingers,
        "grip": "external",
        "opening_min": low,
        "opening_max": high,
        "finger_length": length,
        "actuator": {"maker": "Maker", "model": f"M{number}", "stroke": high - low, "jaw_offset": 0.0},
        "files": {"finger_stl": f"grippers/{name}/finger.stl", "body_stl": f"grippers/{name}/body.stl"},
        "handles": [handle],
    }


def _handle(number: int, component: str, openings: tuple[float, float], tip_mm: float, gap_mm: float) -> dict[str, Any]:
    width, release = openings
    return {
        "operation": f"op-0{number}",
        "component": component,
        "segment": 0,
        "opening_width": width,
        "release_opening": release,
        "contact_offset": 0.0,
        "grasp_pose": from_above(tip_mm).tolist(),
        "gap": gap_mm,
    }


def _sound() -> Bench:
    names = ("block", "pin", "ring")
    up, around_pin = shifted(0, 0, 80), turned(np.pi / 2, about=(40.0, 0.0))
    no_grasp = {"reason": "painted", "box": {"min": [-11, -16, -1], "max": [11, 16, 6]}}
    segment = {"id": 0, "graspable": True, "finger_length_min": 5.0, "finger_length_max": None}
    components = [{"id": name, "status": "covered", "segments": [segment]} for name in names]
    internal = _gripper(3, 3, (26.0, 31.0), 15.0, _handle(3, "ring", (30.0, 29.0), 4.0, 4.0)) | {"grip": "internal"}
    pad = box([0, -5, -20], [1, 5, 0])
    return Bench(
        product={
            "components": [
                _component("plate", np.eye(4)),
                _component("block", shifted(0, 0, 5)) | {"no_grasp": [no_grasp]},
                _component("pin", shifted(40, 0, 5)),
                _component("ring", shifted(0, 60, 5)),
            ],
            "environment": [{"id": "post", "file": "post.stl", "units": "mm", "pose": shifted(-70, 0, 0).tolist()}],
            "operations": [
                _operation(1, "block", ["plate"], [up, np.eye(4)]),
                _operation(2, "pin", ["plate", "block"], [up, shifted(0, 0, 30) @ around_pin, np.eye(4)]),
                _operation(3, "ring", ["plate", "block", "pin"], [up, np.eye(4)]),
            ],
        },
        design={
            "status": "complete",
            "operations": [{"id": f"op-0{i}", "status": "covered", "detail": None} for i in (1, 2, 3)],
            "components": [*components, {"id": "plate", "status": "not_moved", "segments": []}],
            "grippers": [
                _gripper(1, 2, (8.0, 24.0), 20.0, _handle(1, "block", (20.0, 21.0), 7.0, 7.0)),
                _gripper(2, 3, (8.0, 14.0), 15.0, _handle(2, "pin", (12.0, 13.0), 15.0, 15.0)),
                internal,
            ],
        },
        parts={
            "plate": box([-100, -100, 0], [100, 100, 5]),
            "block": box([-10, -15, 0], [10, 15, 12]),
            "pin": tube(6.0, 0.0, 20.0),
            "ring": tube(20.0, 0.0, 10.0, bore_mm=15.0),
            "post": box([-5, -5, 5], [5, 5, 100]),
        },
        fingers={
            "G1": finger(20.0, 6.0, 14.0, 5.0),
            "G2": finger(15.0, 5.0, 10.0, 2.0),
            "G3": round_finger(15.0, 2.0, 8.0),
        },
        bodies={"G1": box([-22, -20, -75], [22, 20, -25]), "G2": tube(30.0, -60.0, -20.0), "G3": tube(30.0, -60.0, -20.0)},
        bonded={"G1": [trimesh.boolean.difference([finger(20.0, 6.0, 14.0, 5.0), pad]), pad]},
    )


_SOUND = _sound()
