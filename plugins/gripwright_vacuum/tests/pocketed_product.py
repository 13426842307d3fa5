"""A product that jaws alone cannot assemble: plates that lie flush in pockets of a base, and a pin. Lengths in mm."""

import json
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np

CATALOGUE = """maker,model,type,fingers,stroke_basis,opening_max_mm,grip_force_N,mass_kg,body_diameter_mm,body_length_mm
Sample,Ejector 80,vacuum,1,none,80,300,0.35,60,80
Sample,Ejector 32,vacuum,1,none,32,48,0.12,40,50
Sample,Magnet 50,magnetic,1,none,50,600,0.9,80,70
"""
JAWS = ["SMC/MHF2-12D2", "SMC/MHSL3-32D (as in paper)"]
FACES = ["Sample/Ejector 80", "Sample/Ejector 32", "Sample/Magnet 50"]

_PLATE, _INSERT, _GAP = (180.0, 120.0, 8.0), (80.0, 60.0, 5.0), 0.5
_INSERT_X, _PIN_Y = 160.0, 75.0


def write_package(folder: Path, **figures: Any) -> Path:
    """The package; `figures` are further fields of the two plates."""
    cylinder = manifold3d.Manifold.cylinder
    base = _slab(340.0, 180.0, 30.0).translate((60.0, 0.0, -30.0))
    base -= _slab(_PLATE[0] + 2 * _GAP, _PLATE[1] + 2 * _GAP, 20.0).translate((0.0, 0.0, -_PLATE[2]))
    base -= _slab(_INSERT[0] + 2 * _GAP, _INSERT[1] + 2 * _GAP, 20.0).translate((_INSERT_X, 0.0, -_INSERT[2]))
    solids = {
        "base": base,
        "plate": _slab(*_PLATE).translate((0.0, 0.0, -_PLATE[2])),
        "insert": _slab(*_INSERT).translate((_INSERT_X, 0.0, -_INSERT[2])),
        "pin": cylinder(40.0, 8.0, 8.0, 96).translate((_INSERT_X, _PIN_Y, 0.0)),
    }
    folder.mkdir()
    for name, solid in solids.items():
        (folder / f"{name}.stl").write_bytes(stl_bytes(solid))
    more = {"plate": figures, "insert": figures}
    document = {
        "part_number": "FB-1",
        "revision": "A",
        "name": "Flush box",
        "components": [
            {"id": name, "file": f"{name}.stl", "units": "mm", "density": 2700, **more.get(name, {})} for name in solids
        ],
        "operations": [
            {"id": f"op-{name}", "active": [name], "passive": passive, "pose_before": _raised(150.0), "pose_after": _raised(0.0)}
            for name, passive in (("plate", ["base"]), ("insert", ["base", "plate"]), ("pin", ["base", "plate", "insert"]))
        ],
    }
    (folder / "product.json").write_text(json.dumps(document))
    return folder


def stl_bytes(solid: manifold3d.Manifold) -> bytes:
    """A binary STL file."""
    found = solid.to_mesh64()
    corners = np.array(found.vert_properties[:, :3])[np.array(found.tri_verts)]
    records = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    records["corners"] = corners
    return b"mm".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes()


def stl_corners(file: Path) -> np.ndarray:
    """All corners of a binary STL file, (n, 3)."""
    data = file.read_bytes()[84:]
    records = np.frombuffer(data, dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    return records["corners"].astype(float).reshape(-1, 3)


def _slab(x: float, y: float, z: float) -> manifold3d.Manifold:
    return manifold3d.Manifold.cube((x, y, z)).translate((-x / 2.0, -y / 2.0, 0.0))


def _raised(by_mm: float) -> list[list[float]]:
    return [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, by_mm], [0, 0, 0, 1]]
