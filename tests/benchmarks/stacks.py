"""A family of products to measure growth with: plates, rings and blocks set down one on the other, no two alike."""

import json
from pathlib import Path

import numpy as np
import trimesh


def write_stack(folder: Path, count: int) -> None:
    """A package of `count` components, each set down from above on all of those before it."""
    folder.mkdir(parents=True)
    components, operations, level = [], [], 0.0
    for number in range(count):
        name, height = f"part-{number:03d}", 8.0 + 0.01 * number
        _part(number, height).export(folder / f"{name}.stl")
        place = np.eye(4)
        place[2, 3] = level
        components.append(
            {"id": name, "part_number": name, "revision": "A", "file": f"{name}.stl", "units": "mm", "pose": place.tolist()}
        )
        above = np.eye(4)
        above[2, 3] = 150.0
        operations.append(
            {
                "id": f"op-{number:03d}",
                "active": [name],
                "passive": [item["id"] for item in components[:-1]],
                "pose_before": above.tolist(),
                "pose_after": np.eye(4).tolist(),
            }
        )
        level += height
    document = {
        "part_number": f"stack-{count}",
        "revision": "A",
        "name": f"A stack of {count}",
        "components": components,
        "operations": operations,
    }
    (folder / "product.json").write_text(json.dumps(document))


def _part(number: int, height: float) -> trimesh.Trimesh:
    """A disc, a ring or a block that stands on z = 0."""
    size = 20.0 + 0.05 * (number % 100)
    match number % 3:
        case 0:
            part = trimesh.creation.cylinder(radius=size, height=height, sections=96)
        case 1:
            part = trimesh.creation.annulus(r_min=0.5 * size, r_max=size, height=height, sections=96)
        case _:
            part = trimesh.creation.box((1.6 * size, 1.2 * size, height))
    part.apply_translation((0.0, 0.0, height / 2.0))
    return part
