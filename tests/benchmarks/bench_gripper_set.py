"""How long the gripper-set optimisation takes: `python tests/benchmarks/bench_gripper_set.py [components …]`.

Widths from 2 to 200 mm on strokes of 48 and 8 mm, six alternatives at most; `alike` instances give each component six. Each
exactly, in the order of a sequence, and on the paper's uniform grid of 200 openings and 200 finger lengths.
"""

import itertools
import os
import sys

import numpy as np

from gripwright.domain.grasp import GraspConstraint
from gripwright.domain.gripper_set import ComponentAlternatives, GripperClass, GripperSetProblem
from gripwright.plugin_api import RunContext
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer, SetCoverParams

CLASSES = {"parallel-2": GripperClass(stroke_mm=48.0, cost=2.0), "centric-3": GripperClass(stroke_mm=8.0, cost=1.0)}
KINDS = ("spread", "bounded", "alike")
VARIANTS = ((False, 0), (True, 0), (False, 200))


def make_problem(kind: str, count: int, seed: int = 0, *, in_sequence: bool = False) -> GripperSetProblem:
    """`spread`: one to six alternatives, any width. `bounded`: so too, with upper bounds on L. `alike`: six near one size."""
    rng = np.random.default_rng(seed)
    components = []
    for i in range(count):
        size = float(np.exp(rng.uniform(np.log(5.0), np.log(200.0))))
        number = 6 if kind == "alike" else int(rng.integers(1, 7))
        components.append(
            ComponentAlternatives(id=str(i), alternatives=tuple(_alternative(kind, size, rng) for _ in range(number)))
        )
    return GripperSetProblem(classes=CLASSES, components=tuple(components), release_clearance_mm=1.0, in_sequence=in_sequence)


def _alternative(kind: str, size: float, rng: np.random.Generator) -> GraspConstraint:
    low = round(float(rng.uniform(5.0, 60.0)), 1)
    return GraspConstraint(
        gripper_type=str(rng.choice(list(CLASSES))),
        opening_width_mm=round(float(size * rng.uniform(0.3, 1.0) if kind == "alike" else rng.uniform(2.0, 200.0)), 1),
        finger_length_min_mm=low,
        finger_length_max_mm=low + round(float(rng.uniform(5.0, 60.0)), 1) if kind == "bounded" else float("inf"),
    )


def main(counts: list[int]) -> None:
    """Print one row a run; processor seconds, those of the solver's own process included."""
    columns = f"{'instance':<10}{'components':>11}{'solver':>8}{'in seq.':>8}{'grid':>6}{'cpu s':>8}{'grippers':>9}{'bound':>6}"
    print(f"{columns}  not proven")
    for count, kind, solver, (in_sequence, grid) in itertools.product(counts, KINDS, ("cbc", "highs"), VARIANTS):
        problem = make_problem(kind, count, in_sequence=in_sequence)
        optimizer = SetCoverOptimizer(SetCoverParams.model_validate({"solver": solver, "grid": grid}))
        start = _processor_s()
        solution = optimizer.solve(problem, RunContext())
        seconds = _processor_s() - start
        open_ = ", ".join(name for name, detail in solution.detail.items() if detail != "proven")
        print(
            f"{kind:<10}{count:>11}{solver:>8}{in_sequence!s:>8}{grid:>6}{seconds:>8.2f}{len(solution.grippers):>9}"
            f"{solution.lower_bound:>6}  {open_}",
            flush=True,
        )


def _processor_s() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [13, 100, 5000])
