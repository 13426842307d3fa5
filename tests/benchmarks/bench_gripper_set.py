"""How long the gripper-set optimisation takes: `python tests/benchmarks/bench_gripper_set.py [components …]`.

Widths from 2 to 200 mm on strokes of 48 and 8 mm, six alternatives at most; `solid` instances give each component six.
"""

import sys
import time

import numpy as np

from gripwright.domain.grasp import GraspConstraint
from gripwright.domain.gripper_set import ComponentAlternatives, GripperClass, GripperSetProblem
from gripwright.plugin_api import RunContext
from gripwright_builtin.optimizers.set_cover import SetCoverOptimizer, SetCoverParams

CLASSES = {"parallel-2": GripperClass(stroke_mm=48.0, cost=2.0), "centric-3": GripperClass(stroke_mm=8.0, cost=1.0)}
KINDS = ("spread", "bounded", "alike")


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
    """Print one row a run."""
    print(f"{'instance':<10}{'components':>11}{'solver':>8}{'in seq.':>8}{'s':>8}{'grippers':>9}{'bound':>6}  not proven")
    for count in counts:
        for kind in KINDS:
            for solver in ("cbc", "highs"):
                for in_sequence in (False, True):
                    problem = make_problem(kind, count, in_sequence=in_sequence)
                    optimizer = SetCoverOptimizer(SetCoverParams.model_validate({"solver": solver}))
                    start = time.perf_counter()
                    solution = optimizer.solve(problem, RunContext())
                    seconds = time.perf_counter() - start
                    open_ = ", ".join(name for name, detail in solution.detail.items() if detail != "proven")
                    print(
                        f"{kind:<10}{count:>11}{solver:>8}{in_sequence!s:>8}{seconds:>8.2f}{len(solution.grippers):>9}"
                        f"{solution.lower_bound:>6}  {open_}"
                    )


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [13, 100, 5000])
