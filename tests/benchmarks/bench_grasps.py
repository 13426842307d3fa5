"""Grasps planned and checked, beside a yardstick; hand poses, finger lengths, and whole designs.

    python tests/benchmarks/bench_grasps.py [--parts grasps poses design] [--stacks 10 30 100 300]

One JSON object a line. `--stacks` measures whole designs of generated stacks instead.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))

import antipodal
from stacks import write_stack
from whole_design import design

from designed_products import PUMP
from gripwright.cad.limits import DEFAULT_LIMITS
from gripwright.cad.package import read_package
from gripwright.design.finger_lengths import length_min
from gripwright.design.grasp_judge import GraspJudge, HeldComponent
from gripwright.design.hand_check import HandCheck, OperationScene
from gripwright.design.plan import plan_of
from gripwright.design.scenes import Body, held_component, operation_scene
from gripwright.design.stage_table import STAGES
from gripwright.design.stages.constraints import SegmentSearch
from gripwright.design.toolbox import Toolbox
from gripwright.domain.assembly import Component, Operation
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import CENTRIC_3, EXTERNAL, PARALLEL_2, Grasp, GripRequirement
from gripwright.domain.shape import FloatArray, Mesh, SegmentAnalysis
from gripwright.geometry.collision import ConvexShape, MeshSurface, PlacedSurface, Scene
from gripwright.geometry.frames import pose
from gripwright.plugin_api import RunContext
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from gripwright.registry.plans import effective_plan

HELD = ("gear-block", "boss-block", "key", "nut")  # of the sample, held by two fingers
LIMIT_FACES = 200_000
ENVELOPE_MM, OPENING_MAX_MM, TIPS_MM = 30.0, 60.0, 3.0
REPEATS = 3
PLAN = effective_plan(plan_of({"segmenter": "sdf"}))


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parts", nargs="*", default=["grasps", "poses", "design"], choices=["grasps", "poses", "design"])
    parser.add_argument("--stacks", nargs="*", type=int, metavar="COMPONENTS")
    arguments = parser.parse_args()
    parts: dict[str, Callable[[], Iterator[dict[str, Any]]]] = {"grasps": grasps, "poses": poses, "design": designs}
    rows = stacks(arguments.stacks or [10, 30, 100, 300]) if arguments.stacks is not None else None
    for line in rows if rows is not None else (line for name in arguments.parts for line in parts[name]()):
        print(json.dumps(line), flush=True)


def best_of(repeats: int, work: Callable[[], Any]) -> tuple[float, Any]:
    """Least processor seconds of several runs, which tell little of what others on the machine do, and the last answer."""
    least, answer = np.inf, None
    for _ in range(repeats):
        start = time.process_time()
        answer = work()
        least = min(least, time.process_time() - start)
    return float(least), answer


# --- grasps ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A component to be held by two fingers: set down from above, alone."""

    held: HeldComponent
    scene: OperationScene
    tasks: list[tuple[SegmentAnalysis, list[GripRequirement]]]


def grasps() -> Iterator[dict[str, Any]]:
    """Our grasps along the whole operation, the yardstick's against the part's mesh as it lies there."""
    toolbox = build_toolbox(PLAN, load_registry())
    parts = [part_of(item, toolbox) for item in read_package(PUMP, DEFAULT_LIMITS).components if item.id in HELD]
    hand = toolbox.hands[PARALLEL_2]
    finger = mesh_of_solids([solid.vertices_mm for solid in hand.finger(40.0, EXTERNAL)])
    palm = mesh_of_solids([solid.vertices_mm for solid in hand.palm(40.0, ENVELOPE_MM, 100.0)])

    def by_yardstick(kept: bool) -> int:
        plans = [antipodal.plan(part.held.solid, finger, palm, 20, OPENING_MAX_MM, 0, kept) for part in parts]
        return sum(plan.tried for plan in plans)

    yardsticks = {}
    for words, kept in (("hierarchies kept", True), ("hierarchies built anew", False)):
        seconds, count = best_of(REPEATS, lambda kept=kept: by_yardstick(kept))
        yardsticks[words] = 1e3 * seconds / count
        measure = f"yardstick: sampled antipodal rays, {words}"
        yield {"measure": measure, "grasps": count, "ms_a_grasp": round(yardsticks[words], 4)}
    for name, work in (
        ("planned, and checked along the whole operation", plan_and_check),
        ("the same, with lengths, contacts and holding of the first that are free", judge),
    ):
        seconds, count = best_of(REPEATS, lambda work=work: sum(work(part, toolbox) for part in parts))
        each = 1e3 * seconds / count
        times = {f"times_yardstick, {words}": round(yardstick / each, 2) for words, yardstick in yardsticks.items()}
        yield {"measure": name, "grasps": count, "ms_a_grasp": round(each, 4), **times}


def part_of(component: Component, toolbox: Toolbox) -> Part:
    """The component analysed, with what the rules ask of two fingers."""
    prepared = STAGES["prepare"].function({"mesh": component.mesh}, PLAN, toolbox, RunContext())
    inputs = {"prepared": prepared, "segmenter": "sdf"}
    segmentation = STAGES["segment"].function(inputs, PLAN, toolbox, RunContext())
    analysis = STAGES["fit"].function({**inputs, "segmentation": segmentation}, PLAN, toolbox, RunContext())
    grips = STAGES["grips"].function({"component": component, "analysis": analysis}, PLAN, toolbox, RunContext())
    way = np.stack([np.eye(4), np.eye(4)])
    way[0, 2, 3] = 100.0
    operation = Operation(id="op", active=(component.id,), passive=(), motion=way)
    body = Body(component=component, solid=prepared.solid)
    tasks = []
    for item in analysis.segments:
        needs = grips.segments[item.segment.id]
        chosen = [] if isinstance(needs, Rejection) else [need for need in needs if need.gripper_type == PARALLEL_2]
        if chosen:
            tasks.append((item, chosen))
    return Part(
        held=held_component(operation, body, [], prepared.mesh, ()),
        scene=operation_scene(operation, body, [], [], [], 0.1, 1.0),
        tasks=tasks,
    )


def plan_and_check(part: Part, toolbox: Toolbox) -> int:
    """How many grasps were planned; each is checked as the hand comes, closes, goes along and leaves."""
    hand, count = toolbox.hands[PARALLEL_2], 0
    check = HandCheck(part.scene, hand)
    for item, needs in part.tasks:
        for need in needs:
            for planner in toolbox.planners[PARALLEL_2]:
                planned = planner.plan(part.held.component, item.segment, need, hand, RunContext())
                count += len(list(check.roughs(planned, TIPS_MM)))
    return count


def judge(part: Part, toolbox: Toolbox) -> int:
    """How many grasps were planned; they are judged as in a design, until enough are free."""

    def envelopes(gripper_type: str, width_mm: float) -> FloatArray:
        return np.array([ENVELOPE_MM])

    judging, count = GraspJudge(part.held, part.scene, envelopes, RunContext()), 0
    for item, needs in part.tasks:
        search = SegmentSearch(item, needs, judging, toolbox, RunContext())
        search.planned()
        count += search.verdict("").grasps_planned
    return count


def mesh_of_solids(solids: list[FloatArray]) -> Mesh:
    """The surfaces of convex solids together."""
    hulls = [trimesh.convex.convex_hull(vertices) for vertices in solids]
    joined = trimesh.util.concatenate(hulls)
    return Mesh(vertices_mm=np.asarray(joined.vertices), faces=np.asarray(joined.faces))


# --- poses -----------------------------------------------------------------------------------------------------------


def poses() -> Iterator[dict[str, Any]]:
    """A hand among 200,000 faces: poses a second, and L⁻ of a pose."""
    toolbox = build_toolbox(PLAN, load_registry())
    surface = MeshSurface(dented_ball(LIMIT_FACES))
    standing = Scene([PlacedSurface(name="ball", surface=surface, X=np.eye(4))])
    for kind in (PARALLEL_2, CENTRIC_3):
        hand = toolbox.hands[kind]
        check = HandCheck(alone(standing), hand)
        palm = [solid.vertices_mm for solid in hand.palm(40.0, ENVELOPE_MM, 100.0)]
        parts = [(solid.vertices_mm, X) for X in hand.finger_poses(30.0) for solid in hand.finger(40.0, EXTERNAL)]
        parts += [(vertices, np.eye(4)) for vertices in palm]
        places = about_the_ball(2000)
        seconds, hits = best_of(REPEATS, lambda parts=parts, places=places: hand_hits(standing, parts, places))
        yield {
            "measure": f"hand pose, {kind}",
            "faces": len(surface.mesh.faces),
            "hit": round(float(np.mean(hits)), 3),
            "us_a_pose": round(1e6 * seconds / len(places), 2),
        }
        held = [Grasp(X_CG=X, gripper_type=kind, grip=EXTERNAL, opening_width_mm=30.0) for X in about_the_ball(40)]
        length_min(check, held[0], np.array([ENVELOPE_MM]), TIPS_MM)
        seconds, lengths = best_of(
            REPEATS, lambda check=check, held=held: [length_min(check, g, np.array([ENVELOPE_MM]), TIPS_MM)[0][0] for g in held]
        )
        between = float(np.mean([TIPS_MM < length < np.inf for length in lengths]))
        yield {
            "measure": f"finger length of a pose, {kind}",
            "faces": len(surface.mesh.faces),
            "between_least_and_longest": round(between, 3),
            "ms_a_pose": round(1e3 * seconds / len(held), 4),
        }


def hand_hits(scene: Scene, parts: list[tuple[FloatArray, FloatArray]], places: FloatArray) -> list[bool]:
    """Whether any part of the hand touches the scene, for each place of the hand."""
    shapes = [(ConvexShape(vertices), X) for vertices, X in parts]
    hit = np.zeros(len(places), dtype=bool)
    for shape, X in shapes:
        hit[~hit] = scene.first_hits(shape, places[~hit] @ X) >= 0
    return hit.tolist()


def alone(standing: Scene) -> OperationScene:
    """A component far too small to matter, lowered among what stands there."""
    way = np.stack([np.eye(4), np.eye(4)])
    way[0, 2, 3] = 300.0
    grain = Mesh(vertices_mm=1e-3 * np.eye(3), faces=np.array([[0, 1, 2]]))
    attached = Scene([PlacedSurface(name="grain", surface=MeshSurface(grain), X=np.eye(4))])
    return OperationScene(
        attached=attached, standing=standing, X_PC=np.eye(4), motion=way, margin_mm=0.1, release_clearance_mm=1.0
    )


def dented_ball(faces: int) -> Mesh:
    """A waved sphere of radius about 60 with that many triangles."""
    rows = int(np.sqrt(faces / 4))
    turn = np.linspace(0.0, 2.0 * np.pi, 2 * rows, endpoint=False)
    rise = np.linspace(0.0, np.pi, rows + 2)[1:-1]
    radius = 60.0 + 4.0 * np.sin(9.0 * rise)[:, None] * np.cos(7.0 * turn)
    x, y = radius * np.sin(rise)[:, None] * np.cos(turn), radius * np.sin(rise)[:, None] * np.sin(turn)
    z = radius * np.cos(rise)[:, None]
    index = np.arange(rows * 2 * rows).reshape(rows, 2 * rows)
    a, b = index[:-1], np.roll(index, -1, axis=1)[:-1]
    c, d = index[1:], np.roll(index, -1, axis=1)[1:]
    sides = np.stack([np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)]).reshape(-1, 3)
    return Mesh(vertices_mm=np.stack([x, y, z], axis=-1).reshape(-1, 3), faces=sides)


def about_the_ball(count: int) -> FloatArray:
    """Places of a hand that points more or less at the ball's middle, tips from 20 mm within to 10 mm off, (count, 4, 4)."""
    rng = np.random.default_rng(3)
    result = []
    for _ in range(count):
        out = np.array([*rng.normal(0.0, 0.35, 2), 1.0])
        out /= np.linalg.norm(out)
        approach = -out + rng.normal(0.0, 0.1, 3)
        approach /= np.linalg.norm(approach)
        x = np.cross(approach, rng.normal(size=3))
        x /= np.linalg.norm(x)
        result.append(pose(x, np.cross(approach, x), approach, out * (60.0 + rng.uniform(-20.0, 10.0))))
    return np.array(result)


# --- designs ---------------------------------------------------------------------------------------------------------


def designs() -> Iterator[dict[str, Any]]:
    """The sample product: nothing stored, everything stored, and one component changed, for each of three components."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        package = folder / "pump"
        shutil.copytree(PUMP, package)
        cold = design(package, folder / "data", folder / "out")
        yield {"measure": "sample product, cold", "cores": os.cpu_count(), **asdict(cold)}
        again = design(package, folder / "data", folder / "out")
        yield {"measure": "sample product, again", **asdict(again)}
        for component in ("coolant-cover", "shaft", "key"):
            change(package / f"{component}.stl")
            run = design(package, folder / "data", folder / "out")
            yield {
                "measure": f"sample product, {component} changed",
                **asdict(run),
                "share_of_cold": round(run.seconds / cold.seconds, 3),
                "cpu_share_of_cold": round(run.cpu_seconds / cold.cpu_seconds, 3),
            }


def change(file: Path) -> None:
    """Make the part a little longer."""
    part = trimesh.load_mesh(file)
    part.apply_scale((1.0, 1.0, 1.002))
    part.export(file)


def stacks(counts: list[int]) -> Iterator[dict[str, Any]]:
    """Whole designs of growing stacks: in operation k there are k components, each of which is asked about."""
    for count in counts:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_stack(folder / "stack", count)
            run = design(folder / "stack", folder / "data", folder / "out")
            timings = json.loads((folder / "out" / "design.json").read_text())["timings"]
            yield {
                "measure": f"stack of {count}",
                **asdict(run),
                "s_a_component": round(run.seconds / count, 3),
                "ms_a_component_and_operation": round(1e3 * run.seconds / count**2, 3),
                "s_by_part": {key: round(value, 2) for key, value in timings.items() if value >= 0.1},
            }


if __name__ == "__main__":
    main()
