"""The short form of the benchmark of the part family: a handful of its parts, analysed."""

import numpy as np

from benchmarks.bench_part_family import PLANS, Row, row_of
from gripwright.design.analysis import analyse
from gripwright.design.plan import plan_of
from gripwright.registry.building import build_toolbox
from gripwright.registry.discovery import load_registry
from here_runner import HereRunner
from mesh_factory import mesh_of
from part_family import parts

HANDFUL = {
    "frustum 20 to 8 x 15": "cone",
    "pyramid of 5": "pyramid",
    "ball of 30": "sphere",
    "ring 20, 4": "torus",
    "hexagon nut": "prism",
    "dovetail": "extrusion",
}


def analysed(plan: str) -> dict[str, Row]:
    """Each of the handful with one of the benchmark's plans."""
    chosen = plan_of({**PLANS[plan], "segmenter": "primitives"})
    runner = HereRunner(chosen, build_toolbox(chosen, load_registry()))
    solids = parts()
    refs = {name: runner.put(mesh_of(solids[name])) for name in HANDFUL}
    answers = analyse(list(refs.values()), chosen, runner)
    return {name: row_of(runner.get(answers[ref].analysis)) for name, ref in refs.items()}


def test_the_shapes_cover_what_boxes_and_cylinders_leave_out_or_enclose_loosely():
    before, after = analysed("cylinder, box"), analysed("all")

    for name, kind in HANDFUL.items():
        assert kind in after[name].kinds, after[name]
        assert after[name].volume_error < before[name].volume_error
        assert after[name].explained >= before[name].explained - 1e-9
    assert np.mean([row.explained for row in after.values()]) >= 0.97


def test_the_family_has_the_parts_that_the_benchmark_promises():
    solids = parts()

    assert len(solids) >= 50
    assert all(solid.volume() > 0.0 for solid in solids.values())
