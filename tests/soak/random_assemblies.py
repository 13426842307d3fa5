"""Assemblies made up at random, designed by the command line, judged by the checker: `python tests/soak/random_assemblies.py`.

Parts of many shapes stand, lie or lean on a plate, beside each other and beside walls, in CAD frames of their own, and are
set down along straight and bent ways. Every second assembly is designed with the default plan, the others with every shape,
tapered tips and V tips. Any fault, and any end but "complete" or "incomplete", is printed with its seed and kept.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[1]))

from checker.promises import check_design
from mesh_factory import mesh_of
from shape_solids import cone, profile, pyramid, slot, zone

Manifold = manifold3d.Manifold
_CELL_MM, _PLATE_MM = 75.0, 12.0
SHAPES = (
    "fitters=cylinder,box,cone,pyramid,sphere,torus,prism,extrusion",
    "rules=three_finger_cylinder,two_finger_box,three_finger_prism,two_finger_prism,two_finger_extrusion,three_finger_sphere,"
    "two_finger_ends,straight_cone,straight_pyramid,three_finger_cone,two_finger_cone,two_finger_cylinder,two_finger_pyramid,"
    "three_finger_pyramid,four_finger_pyramid,three_finger_bore",
    "hands=centric_3,parallel_2,centric_4",
    "planners=axial,facet_pairs,tapered",
)
Draw = Callable[[float, float], float]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1, help="of the first assembly; the others have those that follow")
    parser.add_argument("--keep", type=Path, help="folder for packages and designs with faults")
    arguments = parser.parse_args()
    outcomes: Counter[str] = Counter()
    for seed in range(arguments.seed, arguments.seed + arguments.count):
        with tempfile.TemporaryDirectory() as folder:
            outcome = _outcome(Path(folder), seed)
            print(f"{seed}: {outcome}", flush=True)
            outcomes[outcome.split(",")[0]] += 1
            if arguments.keep and outcome.startswith(("FAULT", "FAILED")):
                shutil.copytree(folder, arguments.keep / str(seed), dirs_exist_ok=True)
    print(json.dumps(outcomes))
    return int(any(outcome in ("FAULT", "FAILED") for outcome in outcomes))


def _outcome(folder: Path, seed: int) -> str:
    package, out = folder / "package", folder / "design"
    package.mkdir()
    write_assembly(package, np.random.default_rng(seed))
    settings = SHAPES if seed % 2 else ()
    command = [sys.executable, "-m", "gripwright.cli", "design", str(package), "--out", str(out)]
    command += [word for setting in settings for word in ("--set", setting)]
    environment = os.environ | {"GRIPWRIGHT_DATA": str(folder / "data")}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=1800, check=False)
    if done.returncode not in (0, 3):
        return f"FAILED, exit {done.returncode}: {done.stderr[-2000:]}"
    faults = check_design(out, package)
    if faults:
        return f"FAULT, {[str(fault) for fault in faults]}"
    document = json.loads((out / "design.json").read_text())
    held = sum(operation["status"] == "covered" for operation in document["operations"])
    tips = sum("taper" in gripper or "v_angle" in gripper for gripper in document["grippers"])
    return (
        f"{document['status']}, {held} of {len(document['operations'])} held by {len(document['grippers'])} grippers, "
        f"{tips} of them with shaped tips{', every shape' if settings else ''}"
    )


def write_assembly(folder: Path, rng: np.random.Generator) -> None:
    """A product package of three to six parts."""
    count = int(rng.integers(3, 7))
    placed = {"plate": (Manifold.cube((_CELL_MM * count, 90.0, _PLATE_MM)).translate((0.0, -45.0, 0.0)), np.eye(4))}
    for number in range(count):
        solid = _standing(_solid(rng))
        place = np.eye(4)
        place[:3, 3] = [_CELL_MM * (number + 0.5) + rng.uniform(-8, 8), rng.uniform(-8, 8), _PLATE_MM]
        place[:3, :3] = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)).as_matrix()
        placed[f"part-{number}"] = (solid, place)
    components, operations, friction = [], [], float(rng.choice([0.2, 0.35, 0.5]))
    for number, (name, (solid, place)) in enumerate(placed.items()):
        own = _frame(rng)  # of the CAD, in the solid's frame
        mesh = mesh_of(solid)
        vertices = (mesh.vertices_mm - own[:3, 3]) @ own[:3, :3]
        trimesh.Trimesh(vertices, mesh.faces, process=False).export(folder / f"{name}.stl")
        pose = (place @ own).tolist()
        components.append(
            {"id": name, "file": f"{name}.stl", "units": "mm", "pose": pose, "density": 1500.0, "friction": friction}
        )
        if number:
            operations.append(_operation(name, list(placed)[:number], rng))
    walls = [_wall(folder, number, count, rng) for number in range(int(rng.integers(0, 3)))]
    document = {"part_number": "R", "revision": "A", "name": "Made up", "components": components, "operations": operations}
    (folder / "product.json").write_text(json.dumps({**document, "environment": walls}))


def _operation(name: str, passive: list[str], rng: np.random.Generator) -> dict[str, Any]:
    """Straight down, or slanted, or by way of a point above."""
    above = np.eye(4)
    above[:3, 3] = [*rng.choice([0.0, 15.0, -20.0], 2), 90.0]
    operation: dict[str, Any] = {"id": f"set-{name}", "active": [name], "passive": passive, "pose_after": np.eye(4).tolist()}
    if rng.random() < 0.5:
        return {**operation, "pose_before": above.tolist()}
    over = np.eye(4)
    over[2, 3] = 60.0
    return {**operation, "pose_before": above.tolist(), "waypoints": [over.tolist()]}


def _wall(folder: Path, number: int, count: int, rng: np.random.Generator) -> dict[str, Any]:
    """Across the plate, between two places of parts."""
    low = _CELL_MM * int(rng.integers(0, count + 1)) - 2.0
    wall = Manifold.cube((4.0, 90.0, float(rng.uniform(10, 60)))).translate((low, -45.0, _PLATE_MM))
    mesh = mesh_of(wall)
    trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False).export(folder / f"wall-{number}.stl")
    return {"id": f"wall-{number}", "file": f"wall-{number}.stl", "units": "mm", "pose": np.eye(4).tolist()}


def _frame(rng: np.random.Generator) -> Any:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-50, 50, 3)
    return X


def _standing(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    """In the middle of its place, on z = 0."""
    low, high = np.array(solid.bounding_box()[:3]), np.array(solid.bounding_box()[3:])
    return solid.translate((*(-(low + high) / 2)[:2], -low[2]))


def _solid(rng: np.random.Generator) -> manifold3d.Manifold:
    """A part of at most 60 mm, of one of many kinds."""

    def draw(low: float, high: float) -> float:
        return float(np.round(rng.uniform(low, high), 1))

    made = _KINDS[rng.choice(list(_KINDS))](draw)
    return made.rotate((90.0, 0.0, 0.0)) if rng.random() < 0.25 else made


def _shaft(draw: Draw) -> manifold3d.Manifold:
    thick, thin = draw(8, 18), draw(3, 7)
    return Manifold.cylinder(draw(10, 25), thick, thick, 96) + Manifold.cylinder(draw(30, 55), thin, thin, 96)


def _cup(draw: Draw) -> manifold3d.Manifold:
    radius, wall = draw(10, 25), draw(2, 5)
    return Manifold.cylinder(25.0, radius, radius, 96) - Manifold.cylinder(25.0, radius - wall, radius - wall, 96).translate(
        (0, 0, wall)
    )


def _l_profile(draw: Draw) -> manifold3d.Manifold:
    wide, high, thick = draw(15, 40), draw(12, 30), draw(3, 8)
    corners = [(0.0, 0.0), (wide, 0.0), (wide, thick), (thick, thick), (thick, high), (0.0, high)]
    return profile(corners, draw(15, 45))


def _holed(draw: Draw) -> manifold3d.Manifold:
    block = Manifold.cube((draw(25, 50), draw(20, 40), draw(8, 25)))
    return block - Manifold.cylinder(60.0, 5.0, 5.0, 64).translate((10.0, 10.0, -1.0))


_KINDS: Mapping[str, Callable[[Draw], manifold3d.Manifold]] = {
    "block": lambda draw: Manifold.cube((draw(6, 50), draw(6, 40), draw(6, 40))),
    "pin": lambda draw: Manifold.cylinder(draw(12, 50), *[draw(3, 20)] * 2, 96),
    "shaft": _shaft,
    "cup": _cup,
    "profile": _l_profile,
    "holed block": _holed,
    "frustum": lambda draw: cone(draw(12, 20), draw(5, 11), draw(20, 45), 128),
    "pyramid": lambda draw: pyramid(int(draw(3, 8.9)), draw(22, 36), draw(8, 20), draw(15, 40)),
    "prism": lambda draw: pyramid(int(draw(3, 8.9)), *[draw(12, 36)] * 2, draw(12, 35)),
    "ball": lambda draw: zone(draw(26, 29), -25.0, 25.0, 192),
    "key": lambda draw: profile(slot(draw(25, 45), draw(8, 18)), draw(6, 20)),
}


if __name__ == "__main__":
    sys.exit(main())
