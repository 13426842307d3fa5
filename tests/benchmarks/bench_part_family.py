"""A generated family of parts with cones, pyramids, spheres, tori, prisms and profiles: what the fitters for them bring.

    python tests/benchmarks/bench_part_family.py [--segmenter best] [--friction 0.5] [--every 5] [--no-design]

Each part is analysed, and put down on a plate: with the plan's own fitters and rules, with all that are built in, and with
suction cups (`plugins/gripwright_vacuum`) beside them. The table names the kept primitives, the share of the surface that
they explain, the volume error |V − V_hull| / V_hull of the segments by area (1 for a segment without a primitive), and the
gripper that holds the part; then why a part is held with no plan, the sums, and how many grippers it takes.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from example_plugins import PLUGINS, install_examples
from gripwright.design import pipeline
from gripwright.design.actuator_csv import actuators_from_csv
from gripwright.design.analysis import analyse
from gripwright.design.plan import plan_of
from gripwright.design.stages.keep import explained_share
from gripwright.domain.assembly import AssemblyTask, Component, Operation
from gripwright.domain.shape import Analysis, Mesh
from gripwright.jobs.catalogue import catalogue
from gripwright.jobs.local import LocalRunner
from gripwright.jobs.steps import STAGES_AT, Workshop
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from gripwright.settings import load_settings
from here_runner import HereRunner
from mesh_factory import box_mesh, mesh_of
from part_family import parts

SHAPES = ("cone", "pyramid", "sphere", "torus", "prism", "extrusion")
RULES = (
    "three_finger_prism",
    "two_finger_prism",
    "two_finger_extrusion",
    "three_finger_sphere",
    "three_finger_torus",
    "two_finger_torus",
    "straight_cone",
    "straight_pyramid",
    "two_finger_ends",
    "three_finger_cone",
    "four_finger_cone",
    "two_finger_cone",
    "two_finger_cylinder",
    "two_finger_pyramid",
    "three_finger_pyramid",
    "four_finger_pyramid",
)
ALL: dict[str, Any] = {
    "fitters": ["cylinder", "box", *SHAPES],
    "rules": ["three_finger_cylinder", "two_finger_box", *RULES, "three_finger_bore"],
    "hands": ["centric_3", "parallel_2", "centric_4"],
    "planners": ["axial", "facet_pairs", "tapered"],
}
PLANS: Mapping[str, Mapping[str, Any]] = {
    "cylinder, box": {},
    "all": ALL,
    "all, suction": {
        **ALL,
        "rules": [*ALL["rules"], "vacuum_face"],
        "hands": [*ALL["hands"], "vacuum_1"],
        "planners": [*ALL["planners"], "flat_faces"],
        "holding": ["vacuum"],
        "finger": ["straight", "suction_cup"],
    },
}
EJECTOR = """maker,model,type,fingers,stroke_basis,opening_max_mm,grip_force_N,mass_kg,body_diameter_mm,body_length_mm
ACME,Ejector 60,vacuum,1,none,80,300,0.35,60,80
"""
_CELL_MM, _DROP_MM = 130.0, 80.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """How a part fares with a plan."""

    kinds: str
    explained: float  # share of the surface on its primitives
    volume_error: float
    bare: int  # segments without a primitive
    held_by: str | None = None  # None: not asked
    why_not: str | None = None


def main() -> None:
    """Print the table and, last, one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segmenter", default="best")
    parser.add_argument("--friction", type=float, default=0.2, help="coefficient between fingers and every part")
    parser.add_argument("--every", type=int, default=1, help="only every n-th part")
    parser.add_argument("--no-design", action="store_true", help="analyse alone")
    arguments = parser.parse_args()
    meshes = {name: mesh_of(solid) for name, solid in list(parts().items())[:: arguments.every]}
    options = {"segmenter": arguments.segmenter}
    friction = None if arguments.no_design else arguments.friction
    with tempfile.TemporaryDirectory() as data:
        os.environ["GRIPWRIGHT_DATA"] = data
        _, path = install_examples(Path(data) / "site", [PLUGINS / "gripwright_vacuum"])
        os.environ["PYTHONPATH"] = path
        sys.path[:0] = path.split(os.pathsep)
        tables, totals = {}, {}
        for plan in PLANS:
            began_s = time.monotonic()
            rows, grippers = measured(meshes, PLANS[plan] | options, friction)
            tables[plan] = rows
            totals[plan] = summed(list(rows.values())) | {"grippers": grippers, "seconds": round(time.monotonic() - began_s, 1)}
    print_table(tables)
    print(json.dumps({"parts": len(meshes), "friction": friction, **options, **totals}, indent=1))


def measured(
    meshes: Mapping[str, Mesh], options: Mapping[str, Any], friction: float | None
) -> tuple[dict[str, Row], dict[str, int] | None]:
    """Each part with a plan, and the number of grippers of each type for all that are held; no friction: no design is made."""
    found = analysed(meshes, options)
    rows = {name: row_of(found[name]) for name in meshes}
    if friction is None:
        return rows, None
    settings = load_settings()
    runner = LocalRunner(Workshop.of(settings, STAGES_AT), plan_of(options), workers=2)
    actuators = (*catalogue(settings), *actuators_from_csv(EJECTOR)[0])
    result = pipeline.design(task_of(meshes, friction), actuators, runner.plan, runner)
    (folder,) = runner.map("export", [{"result": {"ref": result}}])
    document = json.loads(runner.get(folder)["design.json"])
    types = {handle["component"]: gripper["gripper_type"] for gripper in document["grippers"] for handle in gripper["handles"]}
    details = {component["id"]: component["detail"] for component in document["components"]}
    rows = {name: replace(row, held_by=types.get(key_of(name), ""), why_not=details[key_of(name)]) for name, row in rows.items()}
    return rows, dict(Counter(gripper["gripper_type"] for gripper in document["grippers"]))


def analysed(meshes: Mapping[str, Mesh], options: Mapping[str, Any]) -> dict[str, Analysis]:
    """The analysis of each mesh with a plan, in this process."""
    plan = plan_of(options)
    runner = HereRunner(plan, build_toolbox(plan, load_registry()))
    refs = {name: runner.put(mesh) for name, mesh in meshes.items()}
    answers = analyse(list(refs.values()), plan, runner)
    return {name: runner.get(answers[ref].analysis) for name, ref in refs.items()}


def row_of(analysis: Analysis) -> Row:
    """What the primitives of a part say."""
    kinds = Counter("none" if item.primitive is None else item.primitive.kind for item in analysis.segments)
    areas = np.array([item.segment.area_mm2 for item in analysis.segments])
    errors = [
        1.0
        if item.primitive is None or item.segment.hull_volume_mm3 <= 0.0
        else abs(item.primitive.volume_mm3 / item.segment.hull_volume_mm3 - 1.0)
        for item in analysis.segments
    ]
    return Row(
        kinds=", ".join(f"{count} {kind}" if count > 1 else kind for kind, count in kinds.items()),
        explained=explained_share(analysis),
        volume_error=float(np.average(errors, weights=areas)),
        bare=kinds["none"],
    )


def task_of(meshes: Mapping[str, Mesh], friction: float) -> AssemblyTask:
    """Every part is put down on its place on one plate."""
    columns = int(np.ceil(np.sqrt(len(meshes))))
    rows = -(-len(meshes) // columns)
    plate = Component(id="plate", mesh=box_mesh((columns * _CELL_MM, rows * _CELL_MM, 10.0)), X_PC=np.eye(4))
    components, operations = [plate], []
    for number, (name, mesh) in enumerate(meshes.items()):
        place, above = np.eye(4), np.eye(4)
        place[:3, 3] = [(number % columns + 0.5) * _CELL_MM, (number // columns + 0.5) * _CELL_MM, 10.0]
        above[2, 3] = _DROP_MM
        components.append(Component(id=key_of(name), mesh=mesh, X_PC=place, friction=friction))
        operations.append(
            Operation(id=f"place {key_of(name)}", active=(key_of(name),), passive=("plate",), motion=np.stack([above, np.eye(4)]))
        )
    return AssemblyTask(
        part_number="FAMILY", revision="A", name="", components=tuple(components), obstacles=(), operations=tuple(operations)
    )


def key_of(name: str) -> str:
    """An id without blanks."""
    return name.replace(" ", "-").replace(",", "").replace("°", "")


def summed(rows: Sequence[Row]) -> dict[str, Any]:
    """The whole family with one plan."""
    asked = [row.held_by for row in rows if row.held_by is not None]
    return {
        "explained_mean": round(float(np.mean([row.explained for row in rows])), 4),
        "parts_explained_to_95_%": sum(row.explained >= 0.95 for row in rows),
        "volume_error_mean": round(float(np.mean([row.volume_error for row in rows])), 4),
        "segments_without_primitive": sum(row.bare for row in rows),
        "parts_held": sum(map(bool, asked)) if asked else None,
    }


def print_table(tables: Mapping[str, Mapping[str, Row]]) -> None:
    """A part a line, the plans side by side."""
    print(f"{'part':28}" + "".join(f" | {plan:26} {'expl.':>5} {'V err':>6} {'held by':10}" for plan in tables))
    for name in next(iter(tables.values())):
        cells = []
        for rows in tables.values():
            row = rows[name]
            held = "–" if row.held_by is None else row.held_by or "NO"
            cells.append(f" | {row.kinds:26.26} {100 * row.explained:4.0f}% {100 * row.volume_error:5.1f}% {held:10}")
        print(f"{name:28}" + "".join(cells))
    *_, last = tables.values()
    for name, row in last.items():
        if row.why_not:
            print(f"{name}: {row.why_not}")


if __name__ == "__main__":
    main()
