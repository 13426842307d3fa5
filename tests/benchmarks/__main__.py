"""Runs the benchmarks beside this file, or those named: `python -m tests.benchmarks [segmentation] [fitting] [gripper_set]`."""

import sys
from pathlib import Path

from tests.run_scripts import run_scripts

HERE = Path(__file__).resolve().parent
BENCHMARKS = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
SHARED = HERE.parents[2] / "shared"
YARDSTICKS = {"segmentation": (SHARED / "bench" / "cgal_sdf", SHARED / "data")}

if __name__ == "__main__":
    sys.exit(run_scripts(__doc__ or "", BENCHMARKS, YARDSTICKS))
