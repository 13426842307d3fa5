"""The sample asked again ten times as finely, with the default plan and with the paper's: is anything promised withdrawn?

    python tests/benchmarks/bench_finer.py [--plans default paper]

One JSON object a line; fails where a handle, a segment or the number of grippers does not stand. Of segments whose least finger
length rises the two figures are told: judging ends after enough free grasps, and finer plans find others first.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))

from whole_design import design

from checker.promises import check_design
from designed_products import PAPER, PUMP
from finer import FINER, FINER_GRASPS, free_segments, withdrawn_handles

PLANS = {"default": ((), 1.0), "paper": (PAPER, 0.0)}  # settings, and the release clearance that they promise


def main() -> int:
    """How many of the measures failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plans", nargs="*", default=list(PLANS), choices=list(PLANS))
    failed = 0
    for plan in parser.parse_args().plans:
        with tempfile.TemporaryDirectory() as name:
            for line in measures(plan, Path(name)):
                failed += not line["stands"]
                print(json.dumps(line), flush=True)
    return failed


def measures(plan: str, folder: Path) -> Iterator[dict[str, Any]]:
    """The design with the plan's own steps, its handles with finer motions, and the design with finer grasps."""
    settings, release_clearance_mm = PLANS[plan]
    usual = design(PUMP, folder / "data", folder / "usual", settings)
    start = time.process_time()
    faults = [str(fault) for fault in check_design(folder / "usual", PUMP, release_clearance_mm, finer=FINER)]
    yield {
        "measure": f"checker, {FINER} steps for one",
        "plan": plan,
        "stands": not faults,
        "faults": faults,
        "cpu_s": round(time.process_time() - start, 1),
    }
    start = time.process_time()
    withdrawn = withdrawn_handles(folder / "usual", PUMP)
    yield {
        "measure": f"calculation, {FINER} legs and arcs for one",
        "plan": plan,
        "stands": not withdrawn,
        "withdrawn": withdrawn,
        "cpu_s": round(time.process_time() - start, 1),
    }
    finer = design(PUMP, folder / "data", folder / "finer", (*settings, *FINER_GRASPS))
    before, after = (json.loads((folder / name / "design.json").read_text()) for name in ("usual", "finer"))
    lost, gained = free_segments(before) - free_segments(after), free_segments(after) - free_segments(before)
    grippers = [document["optimum"]["grippers"] for document in (before, after)]
    yield {
        "measure": "grasps, every step a tenth",
        "plan": plan,
        "stands": not lost and grippers[1] <= grippers[0],
        "grasps": [planned(document) for document in (before, after)],
        "segments_held": len(free_segments(before)),
        "lost": sorted(lost),
        "gained": sorted(gained),
        "grippers": grippers,
        "least_length_rises": rises(before, after),
        "cpu_s": [usual.cpu_seconds, finer.cpu_seconds],
        "seconds": [usual.seconds, finer.seconds],
    }


def planned(document: dict[str, Any]) -> int:
    return sum(segment["grasps_planned"] for component in document["components"] for segment in component["segments"])


def rises(before: dict[str, Any], after: dict[str, Any]) -> dict[str, list[float]]:
    """Component → L⁻ before and after, mm, where it is greater after."""
    usual, finer = lengths(before), lengths(after)
    return {
        name: [usual[name, k], finer[name, k]] for name, k in sorted(usual) if finer.get((name, k), 0.0) > usual[name, k] + 0.01
    }


def lengths(document: dict[str, Any]) -> dict[tuple[str, int], float]:
    return {
        (component["id"], segment["id"]): segment["finger_length_min"]
        for component in document["components"]
        for segment in component["segments"]
        if segment["graspable"]
    }


if __name__ == "__main__":
    sys.exit(main())
