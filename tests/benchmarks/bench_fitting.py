"""Cylinder fits on fresh generated cases, beside PCL's RANSAC on the same vertices.

    python tests/benchmarks/bench_fitting.py [--cases 400] [--seed N] [--pcl PROGRAM]

Without `--pcl` the peer is built from peers/pcl_cylinder.cpp (Debian: libpcl-dev) where the compiler finds PCL.
"""

import argparse
import json
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from fitting_cases import FittingCase, make_case, whole_segment
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
    parser.add_argument("--pcl", type=Path)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    cases = [make_case(rng) for _ in range(arguments.cases)]
    report = {"seed": arguments.seed, "cases": len(cases), "gripwright": summary(cases, fit_ours(cases))}
    program = arguments.pcl or built_peer()
    report["pcl"] = (
        summary(cases, fit_pcl(cases, program)) if program else "not found: install libpcl-dev and pkg-config, or give --pcl"
    )
    print(json.dumps(report, indent=1))


Result = tuple[float, float, float, bool | None]  # seconds, radius in mm, angle between the axes in rad, bore (None: not told)
NOTHING = np.inf


def fit_ours(cases: list[FittingCase]) -> list[Result]:
    """One fit a case, after one that compiles."""
    fitter, results = CylinderFitter(CylinderParams()), []
    fitter.fit(*whole_segment(cases[0].mesh), RunContext())
    for case in cases:
        component, segment = whole_segment(case.mesh)
        start = time.perf_counter()
        found = fitter.fit(component, segment, RunContext())
        seconds = time.perf_counter() - start
        if isinstance(found, Cylinder):
            results.append((seconds, found.radius_mm, angle(found.axis_C, case), found.internal))
        else:
            results.append((seconds, NOTHING, NOTHING, None))
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
            results.append((seconds, values[6] / scale, angle(axis / np.linalg.norm(axis), case), None))
        else:
            results.append((seconds, NOTHING, NOTHING, None))
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
    told = [r[3] == case.bore for r, case in zip(results, cases, strict=True)]
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
        "milliseconds": {f"p{p}": round(1000.0 * float(np.percentile(seconds, p)), 2) for p in (50, 95)},
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
