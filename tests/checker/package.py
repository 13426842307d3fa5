"""Reads a product package: what stands where, and what moves how."""

from __future__ import annotations

import json
import tempfile
import zipfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from checker.shapes import Array, load_mesh, placed


@dataclass(frozen=True, eq=False)
class Body:
    """A component or an obstacle: its mesh in its own frame, and its place in the product."""

    id: str
    mesh: trimesh.Trimesh
    pose: Array
    no_grasp: tuple[Array, ...] = ()  # boxes, (2, 3) each, in the component's frame

    @property
    def in_product(self) -> trimesh.Trimesh:
        return placed(self.mesh, self.pose)


@dataclass(frozen=True, eq=False)
class Operation:
    id: str
    active: tuple[str, ...]
    passive: tuple[str, ...]
    grasp: tuple[str, ...]
    displacements: tuple[Array, ...]  # of the active subassembly, from before to after


@dataclass(frozen=True, eq=False)
class Package:
    components: dict[str, Body]
    operations: dict[str, Operation]
    environment: tuple[tuple[Body, frozenset[str] | None], ...]

    def obstacles(self, operation: Operation) -> list[Body]:
        return [body for body, operations in self.environment if operations is None or operation.id in operations]


def read_package(path: Path) -> Package:
    if path.is_dir():
        return _read_folder(path)
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(path).extractall(folder)
        return _read_folder(next(Path(folder).rglob("product.json")).parent)


def _read_folder(folder: Path) -> Package:
    document = json.loads((folder / "product.json").read_text())
    load = cache(lambda file, units: load_mesh(folder / file, units))

    def body(entry: dict[str, Any]) -> Body:
        boxes = [ban["box"] for ban in entry.get("no_grasp", []) if "box" in ban]
        return Body(
            id=entry["id"],
            mesh=load(entry["file"], entry.get("units", "mm")),
            pose=np.array(entry.get("pose", np.eye(4)), dtype=float),
            no_grasp=tuple(np.array([box["min"], box["max"]], dtype=float) for box in boxes),
        )

    environment = [
        (body(entry), frozenset(entry["operations"]) if "operations" in entry else None)
        for entry in document.get("environment", [])
    ]
    return Package(
        components={entry["id"]: body(entry) for entry in document["components"]},
        operations={entry["id"]: _operation(entry) for entry in document["operations"]},
        environment=tuple(environment),
    )


def _operation(entry: dict[str, Any]) -> Operation:
    poses = [entry["pose_before"], *entry.get("waypoints", []), entry["pose_after"]]
    return Operation(
        id=entry["id"],
        active=tuple(entry["active"]),
        passive=tuple(entry.get("passive", [])),
        grasp=(entry["grasp"],) if entry.get("grasp") else tuple(entry["active"]),
        displacements=tuple(np.array(pose, dtype=float) for pose in poses),
    )
