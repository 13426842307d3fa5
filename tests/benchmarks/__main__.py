"""Runs the benchmarks beside this file, or those named: `python -m tests.benchmarks [segmentation] [fitting] [gripper_set]`."""

import argparse
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
BENCHMARKS = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
SHARED = HERE.parents[2] / "shared"
YARDSTICKS = {"segmentation": (SHARED / "bench" / "cgal_sdf", SHARED / "data")}


def main() -> int:
    """Each benchmark in a process of its own; one without its yardstick is named and left out. The number that failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=f"one of {', '.join(BENCHMARKS)}; all if none is given")
    names = parser.parse_args().names
    unknown = sorted(set(names) - set(BENCHMARKS))
    if unknown:
        parser.error(f"no benchmark is called {unknown[0]!r}; there are {', '.join(BENCHMARKS)}")
    failed = 0
    for name in names or BENCHMARKS:
        print(f"== {name}", flush=True)
        missing = [path for path in YARDSTICKS.get(name, ()) if not path.exists()]
        if missing:
            print(f"left out: its yardstick {os.path.relpath(missing[0], HERE.parents[1])} is not there", flush=True)
            continue
        failed += subprocess.run([sys.executable, str(BENCHMARKS[name])], check=False).returncode != 0
    return failed


if __name__ == "__main__":
    sys.exit(main())
