"""Segmentation against CGAL's, phases apart, both in the same run.

    python tests/benchmarks/bench_segmentation.py [--faces 50000 200000 …] [--exact] [--no-cgal]

Needs ../shared/bench/cgal_sdf (but with --no-cgal) and ../shared/data. Prints one line of JSON a mesh, then a summary a size.
Each mesh is segmented warm in a fresh process, the best of three times; `peak_mb` is that process's highest resident memory.
`spearman` compares our shape diameters with CGAL's on the same mesh, by default and with `energy=published`.
"""

import argparse
import json
import pickle
import resource
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.stats import spearmanr

from gripwright.design.stages.prepare import PrepareSettings, prepare
from gripwright.design.stages.segment import segment
from gripwright.domain.assembly import IDENTITY, Component
from gripwright.domain.errors import Rejection
from gripwright.domain.shape import FloatArray, Mesh
from gripwright.geometry.measures import diagonal_mm
from gripwright.geometry.mesh_repair import repaired
from gripwright.geometry.refine import refine, refined_face_count
from gripwright.plugin_api import RunContext
from gripwright_builtin.segmenters.sdf import SdfSegmenter
from gripwright_builtin.segmenters.surface import surface_of

SHARED = Path(__file__).resolve().parents[3] / "shared"
RAYS, CLUSTERS, SMOOTHNESS = 30, 5, 0.26
MESHES = ("as1/l-bracket.stl", "as1/bolt.stl", "industreal-gears/gear-base.stl", "bolt-nut-m16/bolt-m16.stl")
RAW = ("industreal-gears/gear-large.stl",)
REPEATS = 3


def load(name: str) -> Mesh:
    """A mesh of the shared data, as in its file."""
    file = trimesh.load(SHARED / "data" / name, process=False)
    return Mesh(vertices_mm=np.array(file.vertices, dtype=np.float64), faces=np.array(file.faces, dtype=np.int64))


def refined_to(mesh: Mesh, count: int) -> Mesh:
    """The solid with about `count` faces."""
    solid = repaired(mesh)
    low, high = 1e-4, 0.5
    for _ in range(14):
        middle = np.sqrt(low * high) * diagonal_mm(solid)
        fits = refined_face_count(solid, middle) < 2 * count and len(refine(solid, middle).faces) <= 1.1 * count
        low, high = (low, middle / diagonal_mm(solid)) if fits else (middle / diagonal_mm(solid), high)
    fine = refine(solid, high * diagonal_mm(solid))
    return Mesh(vertices_mm=fine.vertices_mm, faces=fine.faces)


def segment_once(mesh: Mesh) -> tuple[dict[str, float], int]:
    """Seconds of each phase and the number of segments."""
    ctx = RunContext()
    prepared = prepare(mesh, PrepareSettings(), ctx).mesh
    segments = segment(Component(id="mesh", mesh=prepared, X_PC=IDENTITY), SdfSegmenter(SdfSegmenter.Settings()), ctx)
    if isinstance(segments, Rejection):
        raise ValueError(segments.detail)
    return ctx.timings, len(segments)


def child(path: Path) -> None:
    """In the fresh process: warm up on a small mesh, then print the best run on the mesh in the file."""
    segment_once(load(MESHES[0]))
    mesh = pickle.loads(path.read_bytes())
    runs = [segment_once(mesh) for _ in range(REPEATS)]
    timings, segments = min(runs, key=lambda run: sum(run[0].values()))
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"phases": timings, "segments": segments, "peak_mb": peak_mb}))


def ours(mesh: Mesh) -> dict[str, Any]:
    """What a child reports."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.pickle"
        path.write_bytes(pickle.dumps(mesh))
        done = subprocess.run([sys.executable, __file__, "--child", str(path)], capture_output=True, text=True, check=True)
        return dict(json.loads(done.stdout.splitlines()[-1]))


def cgal(mesh: Mesh, exact: bool) -> tuple[dict[str, float], FloatArray]:
    """CGAL's line of JSON and its shape diameters."""
    with tempfile.TemporaryDirectory() as folder:
        path, labels = Path(folder) / "mesh.off", Path(folder) / "labels.txt"
        trimesh.Trimesh(mesh.vertices_mm, mesh.faces, process=False).export(path)
        command = [str(SHARED / "bench" / "cgal_sdf"), *(["--exact"] if exact else []), str(path)]
        command += [str(RAYS), str(CLUSTERS), str(SMOOTHNESS), str(labels)]
        line = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip().splitlines()[-1]
        return json.loads(line), np.loadtxt(labels)[:, 1]


def rank_correlations(mesh: Mesh, diameters: FloatArray) -> dict[str, float]:
    """Spearman's, of either energy's shape diameters with CGAL's."""
    surface, result = surface_of(mesh), {}
    for energy in ("area", "published"):
        segmenter = SdfSegmenter(SdfSegmenter.Settings.model_validate({"energy": energy}))
        found = segmenter.shape_diameters_mm(mesh, surface, RunContext())
        result[energy] = round(float(spearmanr(found, diameters)[0]), 4)
    return result


def compare(name: str, mesh: Mesh, exact: bool, with_cgal: bool) -> dict[str, Any]:
    """One line of the table."""
    report = ours(mesh)
    total = sum(report["phases"].values())
    line = {
        "mesh": name,
        "faces": len(mesh.faces),
        "seconds": round(total, 3),
        "microseconds_a_face": round(1e6 * total / len(mesh.faces), 2),
        "peak_mb": round(report["peak_mb"]),
        "segments": report["segments"],
        "phases": {key: round(value, 3) for key, value in report["phases"].items()},
    }
    if with_cgal:
        theirs, diameters = cgal(mesh, exact)
        line["times_cgal"] = round(theirs["total_s"] / total, 1)
        line["spearman"] = rank_correlations(mesh, diameters)
        line["cgal"] = {key: theirs[key] for key in ("total_s", "sdf_s", "segment_s", "segments")}
    return line


def summary(size: str, lines: list[dict[str, Any]]) -> dict[str, Any]:
    """The median and the worst of a size."""
    worst: dict[str, Any] = {
        "size": size,
        "meshes": len(lines),
        "microseconds_a_face_median": round(float(np.median([line["microseconds_a_face"] for line in lines])), 2),
        "peak_mb_most": max(line["peak_mb"] for line in lines),
    }
    if "times_cgal" in lines[0]:
        ratios = [line["times_cgal"] for line in lines]
        worst |= {"times_cgal_median": round(float(np.median(ratios)), 1), "times_cgal_least": min(ratios)}
        worst["spearman_least"] = {key: min(line["spearman"][key] for line in lines) for key in lines[0]["spearman"]}
    return worst


def main() -> None:
    """One line a mesh, then one a size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faces", type=int, nargs="*", default=[50_000, 200_000])
    parser.add_argument("--exact", action="store_true", help="let CGAL reach its energy's optimum")
    parser.add_argument("--no-cgal", action="store_true", help="our times and memory alone, for meshes too large for CGAL")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        return child(arguments.child)
    sizes: dict[str, list[dict[str, Any]]] = defaultdict(list)
    meshes = [("raw", name, 0) for name in RAW]
    meshes += [(str(count), name, count) for count in arguments.faces for name in MESHES]
    for size, name, count in meshes:
        mesh = refined_to(load(name), count) if count else repaired(load(name))
        sizes[size].append(compare(name, mesh, arguments.exact, not arguments.no_cgal))
        print(json.dumps(sizes[size][-1]), flush=True)
    for size, lines in sizes.items():
        print(json.dumps(summary(size, lines)), flush=True)


if __name__ == "__main__":
    main()
