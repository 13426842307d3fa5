"""Every fault in every stage of a design, many times over.

usage: python tests/soak/fault_matrix.py [--runs 200] [--seed 1] [--output FILE] [--services sqlite postgresql clock]

One line of JSON a run goes to the output, by default build/fault-matrix-SEED.jsonl; runs that it holds already are not made
again. The last line printed is a summary; the exit code is 1 where a promise was broken.
"""

import argparse
import contextlib
import itertools
import json
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "jobs")]

from fault_bench import CLOCK_FAULTS, PLACES, POSTGRESQL_FAULTS, SQLITE_FAULTS, Bench  # noqa: E402

from postgresql_server import running_postgresql  # noqa: E402

FAULTS = {"sqlite": SQLITE_FAULTS, "postgresql": POSTGRESQL_FAULTS, "clock": CLOCK_FAULTS}


def planned(runs, seed):
    """(number, kind of service, fault, place) of each run: every fault of every service in turn, in every place."""
    pairs = [(kind, fault) for kind, faults in FAULTS.items() for fault in faults]
    cells = [(kind, fault, place) for place in PLACES for kind, fault in pairs]
    random.Random(seed).shuffle(cells)
    return [(number, *cell) for number, cell in zip(range(runs), itertools.cycle(cells), strict=False)]


def run_on(kind, runs, note, output):
    """Make the runs of one kind of service."""
    with (
        tempfile.TemporaryDirectory(prefix="gripwright-faults-") as name,
        running_postgresql() if kind == "postgresql" else contextlib.nullcontext() as server,
    ):
        bench = Bench(Path(name), postgresql=server, clock=kind == "clock", disk=kind == "sqlite")
        try:
            bench.start()
            for number, _, fault, place in runs:
                start = time.monotonic()
                broken = bench.run(f"run-{number}-{time.time_ns()}", fault, place)
                note(number=number, service=kind, fault=fault, place=place, broken=broken, seconds=time.monotonic() - start)
            time.sleep(5.0)  # a sweep
            left = bench.leftovers()
        finally:
            processes = bench.stop()
            (output / f"fault-matrix-{kind}.log").write_bytes((Path(name) / "serve.log").read_bytes())
        note(number=f"end of {kind}", service=kind, fault="none", place="end", broken=left + processes, seconds=0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--services", nargs="+", choices=list(FAULTS), default=list(FAULTS))
    chosen = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(143))  # so that nothing is left behind
    output = chosen.output or ROOT / "build" / f"fault-matrix-{chosen.seed}.jsonl"
    output.parent.mkdir(parents=True, exist_ok=True)
    done = [json.loads(line) for line in output.read_text().splitlines()] if output.exists() else []
    known = {run["number"] for run in done}
    todo = [run for run in planned(chosen.runs, chosen.seed) if run[0] not in known]

    def note(**run):
        done.append(run)
        with output.open("a") as file:
            file.write(json.dumps(run) + "\n")
        print(
            f"{run['number']:>4} {run['service']:10} {run['fault']:20} {run['place']:12} {run['seconds']:6.1f} s",
            *run["broken"],
            flush=True,
        )

    for kind in chosen.services:
        runs = [run for run in todo if run[1] == kind]
        if runs:
            run_on(kind, runs, note, output.parent)
    failures = [run for run in done if run["broken"]]
    made = [run for run in done if run["place"] != "end"]
    print(json.dumps({"runs": len(made), "by fault": Counter(run["fault"] for run in made), "failures": len(failures)}))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
