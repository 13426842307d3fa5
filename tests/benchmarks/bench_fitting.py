"""Cylinder fits on fresh generated cases, beside PCL's RANSAC on the same vertices.

    python tests/benchmarks/bench_fitting.py [--cases 400] [--seed N] [--large 100] [--pcl PROGRAM]

The first `--large` cases are fitted a second time with every face divided until there are some 5,000 to 20,000 faces, as a
real segment has. Each fit is timed as the best of three. Without `--pcl` the peer is built from peers/pcl_cylinder.cpp
(Debian: libpcl-dev) where the compiler finds PCL.
"""

import argparse
import itertools
import json
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from fitting_cases import FittingCase, case_of, make_case, whole_segment
from gripwright.domain.shape import Cylinder
from gripwright.geometry.measures import diagonal_mm, face_cross_mm2
from gripwright.plugin_api import RunContext
from gripwright_builtin.fitters.cylinder import CylinderFitter, CylinderParams

PEER = Path(__file__).parent / "peers" / "pcl_cylinder.cpp"
PACKAGES = "pcl_sample_consensus"


def main() -> None:
    """Print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=400)
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**32)
    parser.add_argument("--large", type=int, default=40)
    parser.add_argument("--pcl", type=Path)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    cases = [make_case(rng) for _ in range(arguments.cases)]
    large = [divided_case(case, rng) for case in cases[: arguments.large]]
    program = arguments.pcl or built_peer()
    report: dict[str, object] = {"seed": arguments.seed, "as_generated": compared(cases, program)}
    if large:
        report["large"] = compared(large, program)
    print(json.dumps(report, indent=1))


def compared(cases: list[FittingCase], program: Path | None) -> dict[str, object]:
    """Both fitters on the same cases, and how many times as long as PCL Gripwright takes."""
    ours = fit_ours(cases)
    report: dict[str, object] = {"cases": len(cases), "faces_median": int(np.median([len(case.mesh.faces) for case in cases]))}
    report["gripwright"] = summary(cases, ours) | {"error_over_stated_sigma": honesty(cases, ours)}
    if program is None:
        return report | {"pcl": "not found: install libpcl-dev and pkg-config, or give --pcl"}
    peer = fit_pcl(cases, program)
    report["pcl"] = summary(cases, peer)
    a, b = np.array([r.seconds for r in ours]), np.array([r.seconds for r in peer])
    report["time_over_pcl"] = {name: round(float(f(a) / f(b)), 2) for name, f in STATISTICS.items()}
    return report


class Result(NamedTuple):
    """What a fitter found; infinite where it found nothing."""

    seconds: float
    radius_mm: float = np.inf
    off_rad: float = np.inf  # between the axes
    bore: bool | None = None  # None: not told
    radius_sigma_mm: float = 0.0
    axis_sigma_rad: float = 0.0


STATISTICS: dict[str, Callable[[np.ndarray], float]] = {
    "p50": lambda x: float(np.percentile(x, 50)),
    "p95": lambda x: float(np.percentile(x, 95)),
    "mean": lambda x: float(np.mean(x)),
}
REPEATS = 3


def divided_case(case: FittingCase, rng: np.random.Generator) -> FittingCase:
    """The same surface with more, smaller faces; where there is noise, every new vertex has its own."""
    arc, columns, profile = np.radians(case.arc_deg), case.columns, case.profile
    times = max(1, round(np.sqrt(rng.uniform(5e3, 2e4) / len(case.mesh.faces))))
    rows = np.concatenate([np.linspace(a, b, times, endpoint=False) for a, b in itertools.pairwise(profile)] + [profile[-1:]])
    return case_of(
        case.kind, rows, arc, columns * times, case.height_mm / case.radius_mm, case.bore, case.noise, case.outliers, rng
    )


def fit_ours(cases: list[FittingCase]) -> list[Result]:
    """The fits, after one that compiles."""
    fitter, results = CylinderFitter(CylinderParams()), []
    fitter.fit(*whole_segment(cases[0].mesh), RunContext())
    for case in cases:
        component, segment = whole_segment(case.mesh)
        seconds = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            found = fitter.fit(component, segment, RunContext())
            seconds.append(time.perf_counter() - start)
        if isinstance(found, Cylinder):
            off = angle(found.axis_C, case)
            results.append(
                Result(min(seconds), found.radius_mm, off, found.internal, found.radius_sigma_mm, found.axis_sigma_rad)
            )
        else:
            results.append(Result(min(seconds)))
    return results


def fit_pcl(cases: list[FittingCase], program: Path) -> list[Result]:
    """Vertices and their normals, scaled to a diagonal of 1 since PCL's result depends on the unit."""
    payload, scales = bytearray(), []
    for case in cases:
        scale = 1.0 / diagonal_mm(case.mesh)
        origin = case.mesh.vertices_mm.mean(axis=0)
        rows = np.hstack([(case.mesh.vertices_mm - origin) * scale, vertex_normals(case)])
        payload += struct.pack("<id", len(rows), max(0.005, 3.0 * case.noise * case.radius_mm * scale))
        payload += rows.astype("<f8").tobytes()
        scales.append(scale)
    output = subprocess.run([program], input=bytes(payload), capture_output=True, check=True).stdout.decode()
    results = []
    for line, case, scale in zip(output.splitlines(), cases, scales, strict=True):
        found, seconds, *values = (float(text) for text in line.split())
        axis = np.array(values[3:6])
        if found and np.linalg.norm(axis) > 0:
            results.append(Result(seconds, values[6] / scale, angle(axis / np.linalg.norm(axis), case)))
        else:
            results.append(Result(seconds))
    return results


def vertex_normals(case: FittingCase) -> np.ndarray:
    """Area-weighted, (n, 3)."""
    cross, normals = face_cross_mm2(case.mesh), np.zeros_like(case.mesh.vertices_mm)
    for k in range(3):
        np.add.at(normals, case.mesh.faces[:, k], cross)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)


def angle(axis: np.ndarray, case: FittingCase) -> float:
    """Between two lines, rad."""
    return float(np.arcsin(min(1.0, float(np.linalg.norm(np.cross(axis, case.axis))))))


def summary(cases: list[FittingCase], results: list[Result]) -> dict[str, object]:
    """Shares, errors over the Cramér–Rao bound, and times."""
    seconds, radii, angles = (np.array([r[k] for r in results], dtype=float) for k in range(3))
    off = np.abs(radii / np.array([case.radius_mm for case in cases]) - 1.0)
    good = (off < 0.005) & (angles < np.radians(0.5))
    clean = np.array([case.noise == 0.0 for case in cases])
    pure = clean & np.array([case.outliers == 0.0 for case in cases])
    radius = off[~clean] / np.array([case.radius_bound for case in cases])[~clean]
    axis = angles[~clean] / np.array([case.axis_bound_rad for case in cases])[~clean]
    told = [r.bore == case.bore for r, case in zip(results, cases, strict=True)]
    return {
        "noise_free": int(clean.sum()),
        "noise_free_within_0.5%_and_0.5deg": round(float(good[clean].mean()), 4),
        "of_those_without_outliers": round(float(good[pure].mean()), 4),
        "noisy_error_over_cramer_rao": {
            "radius_rms_of_best_98%": rms_of_most(radius),
            "axis_rms_of_best_98%": rms_of_most(axis),
            "radius_median": round(float(np.median(radius)), 3),
            "axis_median": round(float(np.median(axis)), 3),
        },
        "bore_and_boss_told_apart": round(float(np.mean(told)), 4),
        "milliseconds": {name: round(1000.0 * f(seconds), 3) for name, f in STATISTICS.items()},
    }


def honesty(cases: list[FittingCase], results: list[Result]) -> dict[str, float]:
    """Root mean square of the noisy cases' errors over the standard errors stated with them: 1 where these are honest."""
    noisy = [(case, r) for case, r in zip(cases, results, strict=True) if case.noise > 0.0 and r.radius_sigma_mm > 0.0]
    return {
        "radius_rms_of_best_98%": rms_of_most(np.array([(r.radius_mm - c.radius_mm) / r.radius_sigma_mm for c, r in noisy])),
        "axis_rms_of_best_98%": rms_of_most(np.array([r.off_rad / r.axis_sigma_rad for _, r in noisy])),
    }


def rms_of_most(ratio: np.ndarray) -> float:
    """Root mean square of all but the worst 2 %."""
    return round(float(np.sqrt(np.mean(np.sort(ratio**2)[: int(0.98 * len(ratio))]))), 3)


def built_peer() -> Path | None:
    """The peer program, None where PCL is not installed."""
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", PACKAGES], capture_output=True, text=True, check=False)
    if flags.returncode != 0:
        return None
    program = Path(tempfile.mkdtemp()) / "pcl_cylinder"
    subprocess.run(["g++", "-O2", "-std=c++17", str(PEER), "-o", str(program), *flags.stdout.split()], check=True)
    return program


if __name__ == "__main__":
    main()
